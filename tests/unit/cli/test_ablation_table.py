"""The table of the ablation."""

from __future__ import annotations

from rich.console import Console

from cogmap.cli.experiment.ablation import table
from cogmap.experiments.ablation.measure import Domain, Measured
from cogmap.experiments.ablation.metrics import ablation_metrics
from cogmap.experiments.ablation.outcome import Outcome, failed
from cogmap.experiments.ablation.variants import LABELS, PAPER, VARIANTS


def _printed(domains: list[Domain], measured: Measured) -> list[str]:
    console = Console(width=200, no_color=True)
    with console.capture() as capture:
        console.print(table(domains, ablation_metrics(domains, measured)))
    return capture.get().splitlines()


def test_each_variant_is_a_row_with_its_lost_runs() -> None:
    domains = [Domain("town", "town", "m", []), Domain("loop", "loop", "m", [])]
    measured: Measured = {}
    for variant in VARIANTS:
        outcomes = [Outcome(error, 2.0, 4.0, is_lost=False) for error in (1.0, 3.0)]
        measured["town", variant] = outcomes
        measured["loop", variant] = outcomes
    measured["loop", PAPER] = [failed("no loop was closed"), failed("no loop was closed")]

    lines = _printed(domains, measured)

    for label in LABELS.values():
        (line,) = (line for line in lines if label in line)
        assert "2 ± 1.4 (1.00)" in line
    assert "no number, 2 of 2 lost" in line
    assert any("wheels alone" in line and "4 ± 0" in line for line in lines)
