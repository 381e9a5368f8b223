"""What stands in the boxes of a cycle's picture: words and bars. All lengths are in inches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from cogmap.cli.explain.drawing.lettering import line_in
from cogmap.cli.plots.palette import FAINT, INK, STREET, TRUE

BAR_IN = 0.09
VALUE_IN = 0.36


class Block(Protocol):
    """A part of a box, drawn below the one before it."""

    @property
    def height_in(self) -> float:
        """Return how much of the box's height it takes."""

    def draw(self, axes: Axes, left_in: float, top_in: float, width_in: float) -> None:
        """Draw it below `top_in`."""


@dataclass(frozen=True)
class Gap:
    """Room between blocks."""

    height_in: float

    def draw(self, axes: Axes, left_in: float, top_in: float, width_in: float) -> None:
        """Draw nothing."""


@dataclass(frozen=True)
class Words:
    """Lines of text, that at the right end of the first one fainter."""

    lines: Sequence[str]
    size: float = 8.5
    colour: str = INK
    is_bold: bool = False
    at_right: str = ""
    right_colour: str = FAINT

    @property
    def height_in(self) -> float:
        """Return the height of all lines."""
        return len(self.lines) * line_in(self.size)

    def draw(self, axes: Axes, left_in: float, top_in: float, width_in: float) -> None:
        """Draw each line below the one before it."""
        weight = "bold" if self.is_bold else "normal"
        base_in = top_in - 0.8 * line_in(self.size)
        if self.at_right:
            axes.text(
                left_in + width_in,
                base_in,
                self.at_right,
                ha="right",
                color=self.right_colour,
                fontsize=self.size,
                fontweight=weight,
            )

        for number, line in enumerate(self.lines):
            axes.text(
                left_in,
                base_in - number * line_in(self.size),
                line,
                color=self.colour,
                fontsize=self.size,
                fontweight=weight,
            )


@dataclass(frozen=True)
class Bar:
    """A bar of `share`, at most 1, its value beside it, and a mark where it must reach."""

    share: float
    colour: str
    threshold: float | None = None

    @property
    def height_in(self) -> float:
        """Return the height of the bar, with a little room around it."""
        return BAR_IN + 0.08

    def draw(self, axes: Axes, left_in: float, top_in: float, width_in: float) -> None:
        """Draw the bar from the left, on a pale ground as long as 1."""
        full_in = width_in - VALUE_IN
        low_in = top_in - BAR_IN - 0.04
        axes.add_patch(Rectangle((left_in, low_in), full_in, BAR_IN, fc=STREET, ec="none"))
        long_in = full_in * min(1.0, self.share)
        axes.add_patch(Rectangle((left_in, low_in), long_in, BAR_IN, fc=self.colour, ec="none"))
        axes.text(
            left_in + width_in,
            low_in + BAR_IN / 2,
            f"{self.share:.2f}",
            ha="right",
            va="center_baseline",
            color=INK,
            fontsize=8.5,
        )
        if self.threshold is not None:
            x_in = left_in + full_in * self.threshold
            ends_in = (low_in - 0.035, low_in + BAR_IN + 0.035)
            axes.plot((x_in, x_in), ends_in, color=TRUE, lw=1.1, solid_capstyle="butt")
