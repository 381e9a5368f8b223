"""Labels in a plot that stay inside it and do not hide one another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.patheffects as outlines
from adjustText import adjust_text
from matplotlib.axes import Axes
from matplotlib.text import Text

from cogmap.cli.plots.palette import PAPER

# Iterations, not seconds: the same labels are placed the same on every machine.
MAX_ITERATIONS = 500
EXPAND = (1.1, 1.25)
MIN_LINE_PX = 15
ORDER = 20


@dataclass(frozen=True)
class Label:
    """`text` to stand above the point (x, y), which is given as the axes' data is."""

    text: str
    x: float
    y: float
    colour: str


def place(axes: Axes, labels: list[Label], size: float, chips: bool = False) -> None:
    """Write each label near its point, where there is room, with a line to the point if far away.

    The layout of the figure must be settled. `chips` are white on the label's colour.
    """
    if not labels:
        return

    texts = [_text(axes, label, size, chips) for label in labels]
    adjust_text(
        texts,
        ax=axes,
        iter_lim=MAX_ITERATIONS,
        expand=EXPAND,
        min_arrow_len=MIN_LINE_PX,
        arrowprops={"arrowstyle": "-", "color": "0.4", "lw": 0.9, "zorder": ORDER - 1},
    )


def _text(axes: Axes, label: Label, size: float, chip: bool) -> Text:
    style: dict[str, Any] = {
        "ha": "center",
        "va": "bottom",
        "zorder": ORDER,
        "fontsize": size,
        "linespacing": 1.1,
    }

    if chip:
        box = {"boxstyle": "round,pad=0.2", "fc": label.colour, "ec": "none", "alpha": 0.92}
        return axes.text(label.x, label.y, label.text, color="white", bbox=box, **style)

    halo = [outlines.withStroke(linewidth=2.2, foreground=PAPER)]
    return axes.text(label.x, label.y, label.text, color=label.colour, path_effects=halo, **style)
