"""Figure 5 of the paper, from our own runs: activation and the route that follows it, tours on a
flat map and on a hierarchy, and how much longer than the shortest they are, beside people's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cogmap.cli.plots.palette import (
    ESTIMATE,
    FAINT,
    GOAL,
    KERB,
    SEVERAL,
    STREET,
    TRUE,
)
from cogmap.cli.plots.sheet import describe, new_sheet, remove_scales
from cogmap.experiments.route_planning import published
from cogmap.experiments.route_planning.activation import Spread, free_ground, walled_ground
from cogmap.experiments.route_planning.measure import EXAMPLE_GOALS, Planned
from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.tours import TourSettings

PEOPLE = TRUE
PUBLISHED = SEVERAL[3]
TICKS = (4, 6, 10, 20, 40, 80, 120)


class Style(NamedTuple):
    """How the tours of one plan are drawn, and what they are called."""

    colour: str
    marker: str
    label: str


# By the names of the plans in Planned.
PLANS = {
    "flat": Style(SEVERAL[0], "v", "flat"),
    "hierarchical": Style(ESTIMATE, "o", "hierarchical"),
    "straightened": Style(SEVERAL[2], "^", "straightened in the end"),
}


def figure(human: Sequence[Planned], drawn: Sequence[Planned], metrics: dict[str, Any]) -> Figure:
    """Draw the sheet: above, one goal and several; below, all problems by their number of goals,
    and those of people one by one.
    """
    example = next(problem for problem in drawn if problem.goals == EXAMPLE_GOALS)
    title = "Figure 5 from our own runs, " + _participants(human, metrics)
    with new_sheet(15.0, 10.0, title) as sheet:
        parts: Any = sheet.subfigures(2, 1, height_ratios=(1, 1.35))
        above, below = parts
        free, walled, flat, hierarchical = above.subplots(1, 4)
        _draw_activation(free, free_ground(), "a   one goal: activation, from dark to bright")
        _draw_activation(walled, walled_ground(), "b   the same with walls, grey")
        _draw_tour(flat, example, example.typical_flat, "flat", "c   flat")
        _draw_tour(hierarchical, example, example.typical, "hierarchical", "d   hierarchy")
        _draw_grids(hierarchical, example.positions, TourSettings())

        if human:
            sizes, people, errors = below.subplots(1, 3)
            _draw_people(people, human)
            _draw_errors(errors, human, metrics)
        else:
            sizes = below.subplots()
        _draw_sizes(sizes, drawn)
    return sheet


def _participants(human: Sequence[Planned], metrics: dict[str, Any]) -> str:
    """Tell how many simulated participants planned each problem."""
    of_drawn = f"{metrics['participants_of_drawn_problems']:g}"
    if not human:
        return f"{of_drawn} simulated participants on each problem"
    of_people = f"{metrics['participants']:g}"
    return f"{of_people} simulated participants on each problem of people, {of_drawn} on the others"


def _draw_activation(axes: Axes, ground: Spread, title: str) -> None:
    """Draw the logarithm of the activation in colours, walls in grey, and the route to the goal."""
    activation = np.ma.masked_invalid(ground.log_activation.T)
    colours = mpl.colormaps["viridis"].with_extremes(bad=KERB)
    axes.imshow(activation, origin="lower", cmap=colours, interpolation="nearest")
    start, *_, goal = ground.route.tolist()
    axes.plot(*ground.route.T, color=ESTIMATE, lw=2.0, label="route")
    axes.plot(*start, "s", ls="", ms=8, mfc="white", mec=TRUE, label="start")
    axes.plot(*goal, "*", ls="", ms=15, mfc=GOAL, mec=TRUE, label="goal")
    axes.legend(fontsize=8, loc="lower right", framealpha=0.85)
    describe(axes, title)
    remove_scales(axes)


def _draw_tour(axes: Axes, problem: Planned, tour: Indices, name: str, title: str) -> None:
    """Draw a closed tour past the goals, of one of the PLANS."""
    positions = problem.positions
    line = _closed(positions, tour)
    axes.plot(*line.T, color=PLANS[name].colour, lw=1.8, zorder=3)
    axes.plot(*positions.T, "o", ms=6, color=TRUE, mec="white", zorder=4)
    axes.plot(*line[0], "s", ms=9, mfc="white", mec=TRUE, zorder=4)
    axes.set_aspect("equal")

    shortest_m, length_m = (
        float(np.hypot(*np.diff(each, axis=0).T).sum())
        for each in (_closed(positions, problem.shortest), line)
    )
    describe(axes, f"{title}: {length_m / shortest_m - 1:.1%} above the shortest")
    remove_scales(axes)


def _closed(positions: Floats, tour: Indices) -> Floats:
    """Return the (n + 1, 2) line of a tour, back to where it begins."""
    line: Floats = positions[np.append(tour, tour[0])]
    return line


def _draw_grids(axes: Axes, positions: Floats, settings: TourSettings) -> None:
    """Draw the two coarsest grids, as they lie over the problem if they are not turned."""
    lowest = positions.min(axis=0)
    highest = positions.max(axis=0)
    side = float(np.max(highest - lowest))
    left, bottom = (lowest + highest - side) / 2

    for level, width in ((2, 0.5), (1, 1.4)):
        style: dict[str, Any] = {"colors": STREET, "linewidths": width, "zorder": 1}
        shares = np.linspace(0.0, side, settings.factor**level + 1)
        axes.vlines(left + shares, bottom, bottom + side, **style)
        axes.hlines(bottom + shares, left, left + side, **style)


def _draw_sizes(axes: Axes, drawn: Sequence[Planned]) -> None:
    """Draw means over the problems of each size, beside published ones."""
    sizes = sorted({problem.goals for problem in drawn})
    for name, style in PLANS.items():
        percent = []
        for size in sizes:
            means = [getattr(problem, name).mean() for problem in drawn if problem.goals == size]
            percent.append(100 * np.mean(means))
        axes.plot(sizes, percent, "o-", ms=4, color=style.colour, label=f"ours, {style.label}")

    drawn_percent = {size: 100 * share for size, share in published.DRAWN_HUMAN.items()}
    for values, marker, colour, whose in (
        (drawn_percent, "s", PEOPLE, "people, drawn problems, published"),
        (published.HUMAN_PERCENT, "^", PEOPLE, "people, Madl et al. 2013*"),
        (published.MODEL_PERCENT, "D", PUBLISHED, "their model*"),
    ):
        published_sizes = list(values)
        axes.plot(published_sizes, list(values.values()), marker, ms=5, color=colour, label=whose)
    axes.set_xscale("log")
    axes.set_xticks(TICKS, [str(size) for size in TICKS])
    axes.minorticks_off()
    _leave_room(axes)
    axes.legend(
        frameon=False,
        fontsize=8,
        loc="upper left",
        title=f"* {published.READ_OFF_BY_EYE}",
        title_fontsize=7,
    )
    describe(axes, "e   drawn at random, by number of goals", "goals", "% above the shortest")


def _draw_people(axes: Axes, human: Sequence[Planned]) -> None:
    """Draw people's quartiles on each problem, the medians of the model and of the flat map."""
    describe(axes, "f   problems that people drew tours of", y="% above the shortest")
    quartiles = 100 * np.array([problem.people_quartiles for problem in human])
    lows, highs = quartiles.T
    places = np.arange(len(human))
    axes.bar(places, highs - lows, 0.6, lows, color=KERB, label="people, the middle half")

    medians = _medians_percent(human, "people")
    axes.plot(places, medians, "_", ms=22, mew=2, color=PEOPLE, label="people, median")
    for name, style in PLANS.items():
        drawn: dict[str, Any] = {"color": style.colour, "label": f"{style.label}, median"}
        axes.plot(places, _medians_percent(human, name), style.marker, ms=7, mec="white", **drawn)

    names = [f"{problem.name.removeprefix('Graph')}\n{problem.goals}" for problem in human]
    axes.set_xticks(places, names)
    axes.set_xlabel("problem, and its goals", color=FAINT)
    _leave_room(axes)
    axes.legend(frameon=False, fontsize=8, loc="upper left")


def _medians_percent(human: Sequence[Planned], name: str) -> list[float]:
    """Compute the median excess on each problem, of people or of a plan."""
    return [100 * float(np.median(getattr(problem, name))) for problem in human]


def _draw_errors(axes: Axes, human: Sequence[Planned], metrics: dict[str, Any]) -> None:
    """Draw the mean excess of the model against that of people, a point for each problem."""
    mean = "mean % above the shortest"
    describe(axes, "g   do they err on the same problems?", f"people, {mean}", f"model, {mean}")
    people = [100 * problem.people.mean() for problem in human]
    for name, style in PLANS.items():
        ours = [100 * getattr(problem, name).mean() for problem in human]
        r = metrics[f"{name}_correlation_with_people"]
        label = f"{style.label}, r = {r:.2f}"
        axes.plot(people, ours, style.marker, ms=6, color=style.colour, mec="white", label=label)

    axes.axline((0.0, 0.0), slope=1.0, color=FAINT, lw=1.0, ls=(0, (4, 2)))
    axes.legend(frameon=False, fontsize=8)


def _leave_room(axes: Axes) -> None:
    """Leave room for the legend, above what is drawn."""
    _, top = axes.get_ylim()
    axes.set_ylim(-0.03 * top, 1.45 * top)
