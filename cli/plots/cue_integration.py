"""Figure 7 of the paper, from our own trials: the room with the responses, SD and RMSE by
condition.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from cogmap.cli.plots.palette import ESTIMATE, FAINT, FUSED, INK, KERB, OBJECT, SEVERAL, TRUE
from cogmap.cli.plots.sheet import describe, new_sheet
from cogmap.experiments.cue_integration import published
from cogmap.experiments.cue_integration.geometry import LANDMARKS, POSTS, ROUTES, START, Points
from cogmap.experiments.cue_integration.run import Outcome
from cogmap.experiments.cue_integration.trial import Condition

NAMES = {
    Condition.SELF_MOTION: "self-motion",
    Condition.LANDMARKS: "landmarks",
    Condition.BOTH: "both",
    Condition.CONFLICT: "conflict",
}
COLOURS = {
    Condition.SELF_MOTION: FUSED,
    Condition.LANDMARKS: OBJECT,
    Condition.BOTH: SEVERAL[2],
    Condition.CONFLICT: SEVERAL[6],
}
OURS = ESTIMATE
THEIRS = KERB
OPTIMAL = TRUE


def figure(found: Outcome) -> Figure:
    """Draw the sheet: the room, the responses, and their SD and RMSE by condition."""
    noise = found.noise
    trials = len(found.errors_m[Condition.BOTH])
    title = (
        f"Cue integration in Nardini's room, {trials} trials a condition\n"
        f"simulated senses err by {noise.landmark:.0%} of a landmark's distance, "
        f"{noise.speed:.0%} of speed and {noise.turn:.0%} of turn rate"
    )
    with new_sheet(13, 7.6, title, dpi=130) as sheet:
        panels = sheet.subplot_mosaic([["room", "responses", "responses"], ["room", "sd", "rmse"]])
        _draw_room(panels["room"])
        _draw_responses(panels["responses"], found)

        sds_m = {condition: found.sd_m(condition) for condition in Condition}
        _draw_bars(panels["sd"], sds_m, published.SD_M, "c   SD of the responses")
        panels["sd"].hlines(
            found.optimal_sd_m, 1.6, 2.0, color=OPTIMAL, lw=2, label="optimal combination of ours"
        )
        panels["sd"].legend(frameon=False, fontsize=8, loc="upper right")

        rmses_m = {condition: found.rmse_m(condition) for condition in Condition}
        _draw_bars(panels["rmse"], rmses_m, published.RMSE_M, "d   RMSE of the responses")
    return sheet


def _draw_room(axes: Axes) -> None:
    """Draw the room from above, and one of the ways through it."""
    axes.plot(
        *np.array([START, *(POSTS[post] for post in ROUTES[0])]).T,
        color=FAINT,
        lw=1.2,
        ls=(0, (4, 2)),
    )
    axes.plot(*np.array(LANDMARKS).T, "*", ms=17, color=OBJECT, mec="white")
    axes.plot(*np.array(POSTS).T, "o", ms=7, color=TRUE, mec="white")
    for number, (x_m, y_m) in enumerate(POSTS):
        axes.annotate(
            str(number), (x_m, y_m), (5, 4), textcoords="offset points", fontsize=8, color=INK
        )
    axes.plot(*START, "s", ms=8, mfc="white", mec=TRUE)
    axes.annotate("start", START, (8, -3), textcoords="offset points", color=INK)
    axes.set_aspect("equal")
    describe(axes, "a   room, landmarks (stars), posts, a route", "x, metres", "y, metres")


def _draw_responses(axes: Axes, found: Outcome) -> None:
    """Draw where the post was put, all routes laid over each other, with one SD about the mean."""
    for condition, errors_m in found.errors_m.items():
        colour = COLOURS[condition]
        axes.plot(*errors_m.T, ".", ms=3, color=colour, alpha=0.5)
        axes.add_patch(_one_sd(found.kept_m(condition), colour))
        axes.plot([], [], color=colour, lw=2, label=NAMES[condition])
    for x_m, name in ((0.0, "where it stood"), (found.shift_m, "where turned landmarks say")):
        axes.plot(x_m, 0, "+", ms=12, mew=2, color=TRUE)
        axes.annotate(name, (x_m, 0), (4, -14), textcoords="offset points", fontsize=8, color=INK)
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(frameon=False, fontsize=8, loc="upper right")
    x = "metres in the direction in which turned landmarks move the target"
    describe(axes, "b   responses, and their SD about the mean", x, "metres towards post 8")


def _one_sd(errors_m: Points, colour: str) -> Ellipse:
    values, vectors = np.linalg.eigh(np.cov(errors_m, rowvar=False))
    angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
    width, height = 2 * np.sqrt(values[::-1])
    return Ellipse(
        tuple(errors_m.mean(axis=0)),
        width,
        height,
        angle=angle,
        fill=False,
        ec=colour,
        lw=2,
        zorder=5,
    )


def _draw_bars(
    axes: Axes, ours: dict[Condition, float], theirs: dict[Condition, float], title: str
) -> None:
    places = np.arange(len(Condition))
    for offset, values, colour, label in (
        (-0.2, ours, OURS, "ours"),
        (0.2, theirs, THEIRS, published.SOURCE),
    ):
        heights = [values[condition] for condition in Condition]
        bars = axes.bar(places + offset, heights, 0.38, color=colour, label=label)
        axes.bar_label(bars, fmt="%.2f", fontsize=7.5, color=INK, padding=5)
    axes.set_xticks(places, [NAMES[condition] for condition in Condition])
    axes.set_ylim(0, 1.35 * max(*ours.values(), *theirs.values()))
    axes.legend(frameon=False, fontsize=8)
    describe(axes, title, y="metres")
