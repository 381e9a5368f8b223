"""`cogmap experiment predictions`: an example is written, and read with what is found in it."""

from __future__ import annotations

import json
import os
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from cogmap.cli.main import cogmap
from cogmap.errors import UsageError

needs_pynwb = pytest.mark.skipif(
    find_spec("pynwb") is None and "CI" not in os.environ, reason="pynwb is not installed"
)


def command(*words: str | Path) -> Result:
    """Run `cogmap experiment predictions` with these words. Raises what it raises."""
    arguments = ["experiment", "predictions", *map(str, words)]
    result = CliRunner().invoke(cogmap, arguments, standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings") / "example.nwb"
    command("--example", path)
    return path


@needs_pynwb
def test_what_is_in_the_example_is_found_and_drawn(example: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    printed = command(example, "--out", out, "--json", tmp_path / "found.json").stdout
    facts: dict[str, Any] = json.loads((tmp_path / "found.json").read_text())

    assert example.stat().st_size < 500_000
    assert facts["session_description"].startswith("SYNTHETIC")
    assert {facts[f"{name}_verdict"] for name in ("replays", "shifts", "synapses")} == {"found"}
    assert "place fields shift after a revisit: found" in printed
    assert (out / "predictions.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "predictions.pdf").read_bytes().startswith(b"%PDF")


@needs_pynwb
def test_an_example_without_effects_shows_none(tmp_path: Path) -> None:
    path = tmp_path / "none.nwb"
    described = command("--example", path, "--without-effects").stdout
    printed = command(path, "--out", tmp_path / "out", "--rests", "rests").stdout

    assert "Predicted effects in it: none." in described
    assert printed.count("not found") >= 3


def test_a_recording_or_an_example_is_to_be_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"give either a recording, FILE\.nwb, or --example FILE"):
        command()
    with pytest.raises(UsageError, match=r"give either a recording, FILE\.nwb, or --example FILE"):
        command("rat.nwb", "--example", tmp_path / "example.nwb")
    with pytest.raises(UsageError, match=r"--without-effects is for --example: leave it out"):
        command("rat.nwb", "--without-effects")
