"""Sheets of panels on which the experiments' figures are drawn."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cogmap.cli.plots.draw import STYLE
from cogmap.cli.plots.palette import FAINT, INK, PAPER


@contextmanager
def new_sheet(
    width_in: float, height_in: float, title: str = "", dpi: float = 110
) -> Iterator[Figure]:
    """Yield a figure to draw on, with a title above its panels; it is laid out in the end."""
    with mpl.rc_context(STYLE):
        sheet = Figure(
            figsize=(width_in, height_in), dpi=dpi, facecolor=PAPER, layout="constrained"
        )
        yield sheet
        if title:
            sheet.suptitle(title, x=0.01, ha="left", color=INK, fontsize=12, fontweight="bold")
        for part in sheet.subfigs:
            part.set_facecolor(PAPER)
        sheet.draw_without_rendering()


def describe(axes: Axes, title: str, x: str = "", y: str = "") -> None:
    """Write the title of a panel, and what its axes are."""
    axes.set_title(title, loc="left", color=INK, fontsize=10)
    axes.set_xlabel(x, color=FAINT)
    axes.set_ylabel(y, color=FAINT)
    axes.tick_params(colors=FAINT, length=3)
    axes.set_facecolor(PAPER)


def remove_scales(axes: Axes) -> None:
    """Leave out the ticks of a panel."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_facecolor(PAPER)
