"""The errors of the agent by its rules: ours, one of our additions taken away, the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cogmap.cli.plots.palette import CLOSED, ESTIMATE, FAINT, FUSED, WHEELS
from cogmap.cli.plots.sheet import describe, new_sheet
from cogmap.experiments.ablation.measure import ERROR, Domain, Measured
from cogmap.experiments.ablation.outcome import Outcome
from cogmap.experiments.ablation.variants import LABELS, OURS

PANEL_IN = 4.2
UNITS = {"m": "error, m", "km2": "error, km²", "over_shortest": "way over the shortest"}


def figure(domains: Sequence[Domain], measured: Measured) -> Figure:
    """Draw a panel for each domain, its variants one below the other."""
    with new_sheet(2.0 + PANEL_IN * len(domains), 5.0, "What each rule gains") as sheet:
        panels: Any = sheet.subplots(1, len(domains), sharey=True, squeeze=False)
        for axes, domain in zip(panels[0], domains, strict=True):
            _draw(axes, domain, measured)

        panels[0, 0].set_yticks(range(len(LABELS)), list(LABELS.values()))
        panels[0, 0].invert_yaxis()
        sheet.legend(
            handles=_legend(), frameon=False, fontsize=8.5, ncols=5, loc="outside lower left"
        )
    return sheet


def _legend() -> list[Line2D]:
    return [
        Line2D([], [], marker="o", ls="", ms=4, color=FAINT, label="the agent in a run"),
        Line2D([], [], marker="x", ls="", ms=6, color=CLOSED, label="in a run that was lost"),
        Line2D([], [], marker="D", ls="", ms=7, color=ESTIMATE, label="mean"),
        Line2D([], [], color=FUSED, lw=1.5, label="fused self-motion alone, mean on our drives"),
        Line2D([], [], color=WHEELS, lw=1.5, ls="dotted", label="wheels alone"),
    ]


def _draw(axes: Axes, domain: Domain, measured: Measured) -> None:
    for row, variant in enumerate(LABELS):
        _draw_row(axes, row, measured[domain.name, variant])

    ours = measured[domain.name, OURS]
    axes.axvline(_mean([each.fused for each in ours]), color=FUSED, lw=1.5, zorder=1)
    axes.axvline(_mean([each.wheels for each in ours]), color=WHEELS, lw=1.5, ls="dotted", zorder=2)
    if domain.quantity == ERROR and np.isfinite(axes.dataLim.intervalx).all():
        axes.set_xscale("log")
    axes.grid(axis="x", color=FAINT, alpha=0.2, lw=0.6)
    describe(axes, domain.label, UNITS[domain.unit])


def _draw_row(axes: Axes, row: int, outcomes: Sequence[Outcome]) -> None:
    kept = [each.error for each in outcomes if not each.is_lost]
    lost = [each.error for each in outcomes if each.is_lost]
    axes.plot(kept, [row] * len(kept), "o", ms=4, color=FAINT, alpha=0.7, zorder=3)
    axes.plot(lost, [row] * len(lost), "x", ms=6, color=CLOSED, zorder=3)

    mean = _mean([*kept, *lost])
    axes.plot([mean], [row], "D", ms=7, color=ESTIMATE, mec="white", zorder=4)
    without = sum(not np.isfinite(error) for error in lost)
    if without:
        axes.text(
            0.99,
            row,
            f"{without} without a number",
            transform=axes.get_yaxis_transform(),
            ha="right",
            va="bottom",
            color=CLOSED,
            fontsize=8,
        )


def _mean(errors: Sequence[float]) -> float:
    """Return the mean of those that are numbers, NaN of none."""
    known = [error for error in errors if np.isfinite(error)]
    return float(np.mean(known)) if known else float("nan")
