"""The robot from above, as a motor command moves it. All lengths are in inches."""

from __future__ import annotations

import math
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.patches import FancyArrow, FancyBboxPatch, Rectangle

from cogmap.cli.plots.palette import FAINT, INK, KERB, STREET, TRUE

HALF_ROBOT_IN = 0.24
ARROW_IN = 0.6
FASTEST_RAD_S = 20.0


@dataclass(frozen=True)
class Robot:
    """The robot from above, an arrow at each wheel as long as it is fast."""

    left_rad_s: float
    right_rad_s: float
    colour: str

    @property
    def height_in(self) -> float:
        """Return the height of the robot, with the arrows ahead of it and behind it."""
        ahead, behind = self._reach()
        return 2 * HALF_ROBOT_IN + ahead + behind + 0.16

    def draw(self, axes: Axes, left_in: float, top_in: float, width_in: float) -> None:
        """Draw the robot in the middle of the box."""
        centre_in = left_in + width_in / 2
        ahead, _ = self._reach()
        middle_in = top_in - 0.08 - ahead - HALF_ROBOT_IN
        body = FancyBboxPatch(
            (centre_in - 0.2, middle_in - HALF_ROBOT_IN),
            0.4,
            2 * HALF_ROBOT_IN,
            boxstyle="round,pad=0,rounding_size=0.1",
            fc=STREET,
            ec=KERB,
        )
        axes.add_patch(body)
        across_in = (centre_in - 0.07, centre_in + 0.07, centre_in)
        along_in = (middle_in + 0.08, middle_in + 0.08, middle_in + 0.18)
        axes.fill(across_in, along_in, color=FAINT, lw=0)
        for side, speed_rad_s in ((-1, self.left_rad_s), (1, self.right_rad_s)):
            x_in = centre_in + 0.31 * side
            self._draw_wheel(axes, x_in, middle_in, speed_rad_s)
            axes.text(
                x_in + 0.12 * side,
                middle_in,
                f"{speed_rad_s:.1f}",
                ha="left" if side > 0 else "right",
                va="center",
                color=INK,
                fontsize=8.5,
            )

    def _reach(self) -> tuple[float, float]:
        """Compute how far the arrows reach ahead of the robot, and behind it."""
        speeds_rad_s = (self.left_rad_s, self.right_rad_s)
        ahead = max(0.0, *(_arrow_in(speed) for speed in speeds_rad_s))
        behind = max(0.0, *(-_arrow_in(speed) for speed in speeds_rad_s))
        return ahead, behind

    def _draw_wheel(self, axes: Axes, x_in: float, middle_in: float, speed_rad_s: float) -> None:
        axes.add_patch(Rectangle((x_in - 0.05, middle_in - 0.15), 0.1, 0.3, fc=TRUE, ec="none"))
        if speed_rad_s == 0.0:
            return

        arrow = FancyArrow(
            x_in,
            middle_in + math.copysign(0.17, speed_rad_s),
            0.0,
            _arrow_in(speed_rad_s),
            width=0.035,
            head_width=0.13,
            head_length=min(0.12, abs(_arrow_in(speed_rad_s))),
            length_includes_head=True,
            fc=self.colour,
            ec="none",
        )
        axes.add_patch(arrow)


def _arrow_in(speed_rad_s: float) -> float:
    """Compute the length of a wheel's arrow, negative backwards."""
    return max(-1.0, min(1.0, speed_rad_s / FASTEST_RAD_S)) * ARROW_IN
