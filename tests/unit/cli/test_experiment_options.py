"""Options that the experiments share."""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure

from cogmap.cli.experiment import results
from cogmap.cli.experiment.options import Common, common_options


@click.command()
@common_options
def experiment(common: Common) -> None:
    """Measure nothing."""
    assert common.out is not None
    folder = results.folder_for("experiment", common.out)
    rules = results.show_rules(common)
    results.save(folder, "experiment", Figure(), rules, common)


@pytest.mark.parametrize(
    ("options", "localization", "planning"),
    [((), "cogmap", "hierarchy"), (("--rules", "paper"), "paper", "gradient")],
)
def test_an_experiment_names_its_rules_in_a_line_and_in_its_json(
    tmp_path: Path, options: tuple[str, ...], localization: str, planning: str
) -> None:
    done = CliRunner().invoke(experiment, ["--out", str(tmp_path), *options])
    metrics = json.loads((tmp_path / "experiment.json").read_text())

    assert done.output.startswith(f"rules: localization {localization}, ")
    assert metrics["rules_localization"] == localization
    assert metrics["rules_planning"] == planning


def test_rules_that_nobody_has_are_refused() -> None:
    done = CliRunner().invoke(experiment, ["--rules", "nobody"])

    assert done.exit_code == 2
    assert "'nobody' is not one of 'paper', 'spiking', 'cogmap'" in done.output
