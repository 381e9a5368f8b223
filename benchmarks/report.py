"""Benchmarks print a table and write flat JSON: every key with its value and the bar it is held
against.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Bar:
    """What a figure should be: at most, or at least, `limit`; or from `least` to `limit`."""

    limit: float
    at_least: bool = False
    least: float | None = None

    def holds(self, value: float) -> bool:
        """Whether `value` meets it."""
        if self.least is not None and value < self.least:
            return False
        return value >= self.limit if self.at_least else value <= self.limit

    def __str__(self) -> str:
        if self.least is not None:
            return f"{self.least:g}-{self.limit:g}"
        return f"{'≥' if self.at_least else '≤'} {self.limit:g}"


def publish(
    title: str, figures: dict[str, float], bars: dict[str, Bar], json_path: Path | None
) -> bool:
    """Print and write `figures`; whether every bar holds. Figures without a bar tell how they came
    about.
    """
    table = Table(title=title)
    for heading in ("key", "measured", "bar", ""):
        table.add_column(heading, justify="left" if heading == "key" else "right")
    for key, value in figures.items():
        bar = bars.get(key)
        verdict = "" if bar is None else "[green]met" if bar.holds(value) else "[red]missed"
        table.add_row(key, f"{value:.4g}", str(bar or ""), verdict)
    Console().print(table)
    if json_path is not None:
        json_path.write_text(json.dumps(figures, indent=2) + "\n")
    return all(bar.holds(figures[key]) for key, bar in bars.items())
