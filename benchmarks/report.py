"""The table that a benchmark prints, and the flat JSON that it writes."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from benchmarks.threshold import Threshold
from benchmarks.timing import machine_unit_ms

Metrics = dict[str, float]


@dataclass(frozen=True)
class Outcome:
    """The metrics of one benchmark by key; `failure` is the reason if it could not measure."""

    benchmark: str
    thresholds: Mapping[str, Threshold]
    metrics: Mapping[str, float]
    failure: str = ""

    @property
    def missed(self) -> list[str]:
        """Return the keys whose threshold is missed, or that were not measured."""
        missed = []
        for key, threshold in self.thresholds.items():
            value = self.metrics.get(key, math.nan)
            if not threshold.is_met(value):
                missed.append(key)

        return missed


def with_machine_unit(metrics: Metrics) -> Metrics:
    """Add the unit of this machine's speed to metrics that have just been measured."""
    return metrics | {"machine_unit_ms": machine_unit_ms()}


def report(outcome: Outcome, json_path: Path | None) -> None:
    """Print the metrics of one benchmark, and write them to `json_path`."""
    table = _table(outcome.benchmark)
    _add_rows(table, outcome)
    Console().print(table)

    if json_path is not None:
        write(json_path, outcome.metrics)


def summary(outcomes: list[Outcome]) -> Table:
    """Make one table of all benchmarks, a section each."""
    table = _table("all benchmarks")

    for outcome in outcomes:
        table.add_row(f"[bold]{outcome.benchmark}", "", "", "")
        if outcome.failure:
            table.add_row(escape(outcome.failure), "", "", "[red]failed")
        _add_rows(table, outcome)
        table.add_section()

    return table


def write(path: Path, metrics: Mapping[str, float]) -> None:
    """Write `metrics` to `path` as one flat JSON object."""
    text = json.dumps(dict(metrics), indent=2)
    path.write_text(text + "\n")


def _table(title: str) -> Table:
    table = Table(title=title)
    table.add_column("key")
    for heading in ("measured", "threshold", ""):
        table.add_column(heading, justify="right")

    return table


def _add_rows(table: Table, outcome: Outcome) -> None:
    """Add the keys with a threshold first; those without one explain the others."""
    missed = outcome.missed
    for key, threshold in outcome.thresholds.items():
        value = outcome.metrics.get(key)
        measured = "" if value is None else f"{value:.4g}"
        verdict = "[red]missed" if key in missed else "[green]met"
        table.add_row(key, measured, str(threshold), verdict)

    for key, value in outcome.metrics.items():
        if key not in outcome.thresholds:
            table.add_row(key, f"{value:.4g}", "", "")
