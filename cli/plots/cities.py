"""Figure 8 of the paper, from our own runs: errors of all maps, and true and learned streets side
by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cogmap.cli.plots.palette import (
    ESTIMATE,
    INK,
    KERB,
    OBJECT,
    POSITIONS,
    STREET,
    TRUE,
    UNCORRECTED,
    WHEELS,
)
from cogmap.cli.plots.sheet import describe, new_sheet, remove_scales
from cogmap.experiments.city_maps import published
from cogmap.experiments.city_maps.drive import SENSING
from cogmap.experiments.city_maps.measure import CityMap
from cogmap.experiments.city_maps.metrics import NAMES
from cogmap.experiments.city_maps.observer import WHEELS as WHEELS_ALONE

SHOWN = {
    WHEELS_ALONE: "wheels alone, which fused self-motion is here",
    "none": "landmarks recognised, no loop closed",
    "positions": "positions corrected (eq. 9)",
    "heading": "headings too",
}
COLOURS = {
    WHEELS_ALONE: WHEELS,
    "none": UNCORRECTED,
    "positions": POSITIONS,
    "heading": ESTIMATE,
}
MAX_SHEETS = 8
MANY = 3
VIEWS = 3
"""Panels of a map: as it is, as it was learned, and with its loop closed."""

MARGIN_M = 120.0
SCALE_M = 200.0


def figure(maps: Sequence[CityMap], metrics: dict[str, Any]) -> Figure:
    """Draw the sheet: errors on top; below, true and learned maps of at most MAX_SHEETS of them,
    from the shortest tour to the longest: a column each if they are MANY, otherwise a row.
    """
    ordered = sorted(maps, key=lambda each: each.environment.tour_m)
    picks = np.linspace(0, len(ordered) - 1, min(MAX_SHEETS, len(ordered))).round().astype(int)
    chosen = [ordered[pick] for pick in np.unique(picks).tolist()]
    many = len(chosen) >= MANY
    rows, columns = (VIEWS, len(chosen)) if many else (len(chosen), VIEWS)
    with new_sheet(max(11.0, 2.9 * columns), 5.0 + 2.9 * rows, _title(maps, metrics)) as sheet:
        grid = sheet.add_gridspec(2, 1, height_ratios=(4.0, 2.9 * rows))
        errors, sizes = sheet.add_subfigure(grid[0]).subplots(1, 2, width_ratios=(2.2, 1))
        _draw_errors(errors, maps)
        _draw_growth(sizes, maps, metrics)

        part = sheet.add_subfigure(grid[1])
        panels = part.subplots(rows, columns, squeeze=False)
        for views, each in zip(panels.T if many else panels, chosen, strict=True):
            _draw_maps(views.tolist(), each)
        part.legend(handles=_legend(), frameon=False, fontsize=8, ncols=4, loc="outside lower left")
    return sheet


def _title(maps: Sequence[CityMap], metrics: dict[str, Any]) -> str:
    traversals = len(maps[0].learned)
    each = "once" if traversals == 1 else f"{traversals} times"
    environments = "an environment" if len(maps) == 1 else f"{len(maps)} environments"
    return (
        f"Learned maps of {environments}, traversed {each}{' each' if len(maps) > 1 else ''}, "
        f"{SENSING}.\nError with the loop closed over that without: "
        f"{metrics['error_corrected_over_uncorrected']:.2f} with headings, "
        f"{metrics['error_positions_over_uncorrected']:.2f} positions only"
    )


def _draw_growth(axes: Axes, maps: Sequence[CityMap], metrics: dict[str, Any]) -> None:
    """Draw the error of each map by the length of its tour and, of several, how it grows."""
    length_km = np.array([each.environment.tour_m / 1e3 for each in maps])
    ends_km = np.array([length_km.min(), length_km.max()])
    for method, name in NAMES.items():
        error_km2 = np.array([each.error_km2(method) for each in maps])
        axes.plot(length_km, error_km2, "o", ms=5, color=COLOURS[method], mec="white")
        if len(maps) > 1:
            slope = metrics[f"growth_{name}_km2_per_km"]
            line_km2 = error_km2.mean() + slope * (ends_km - length_km.mean())
            axes.plot(ends_km, line_km2, color=COLOURS[method], label=f"{slope:+.2f}/km")

    axes.set_ylim(bottom=0)
    if len(maps) > 1:
        axes.legend(frameon=False, fontsize=8, title="km² for a km of tour", title_fontsize=8)
    describe(axes, "b   error by the length of the tour", "tour, km", "km²")


def _legend() -> list[Line2D]:
    """Return the legend of the maps."""
    square: dict[str, Any] = {"marker": "s", "ls": "", "mec": "white"}
    return [
        Line2D([], [], color=TRUE, lw=1.4, label="the tour"),
        Line2D([], [], color=UNCORRECTED, lw=1.4, label="its path as learned, no loop closed"),
        Line2D([], [], color=ESTIMATE, lw=1.4, label="its path with loop and headings corrected"),
        Line2D([], [], color=STREET, lw=1.4, label="other streets"),
        Line2D([], [], ms=6, color=TRUE, label="building", **square),
        Line2D([], [], ms=7, color=OBJECT, label="learned building", **square),
        Line2D([], [], color=OBJECT, lw=0.8, ls="dotted", label="its error"),
    ]


def _draw_errors(axes: Axes, maps: Sequence[CityMap]) -> None:
    places = np.arange(len(maps))
    for offset, (method, label) in zip((-0.3, -0.1, 0.1, 0.3), SHOWN.items(), strict=True):
        axes.bar(
            places + offset,
            [each.error_km2(method) for each in maps],
            0.19,
            color=COLOURS[method],
            label=label,
        )
    for mean, style, who in (
        (published.HUMAN_MEAN_KM2, "-", "people"),
        (published.MODEL_MEAN_KM2, (0, (4, 2)), "the paper's model"),
    ):
        axes.axhline(
            mean,
            color=TRUE,
            lw=1.2,
            ls=style,
            label=f"{who}, mean {mean:g} km², {published.SOURCE}",
        )
    axes.axhspan(
        max(published.HUMAN_MEAN_KM2 - published.HUMAN_SD_KM2, 0.0),
        published.HUMAN_MEAN_KM2 + published.HUMAN_SD_KM2,
        color=KERB,
        alpha=0.35,
        lw=0,
        zorder=0,
        label=f"people, one SD, {published.SOURCE}",
    )
    axes.set_xticks(places, [_name(each) for each in maps], rotation=40, ha="right", fontsize=7.5)
    axes.set_ylim(0, axes.get_ylim()[1] * 1.45)
    axes.legend(frameon=False, fontsize=7.5, ncols=2, loc="upper left")
    title = "a   error of each map: sum of squared errors of its 8 buildings"
    describe(axes, title, y="km²")


def _draw_maps(column: Sequence[Axes], each: CityMap) -> None:
    """Draw the truth and, of the median traversal, the map as learned and with its loop closed."""
    one = each.typical
    environment = each.environment
    tour = np.vstack(environment.legs_m)
    reach = [tour]
    _streets(column[0], each)
    column[0].plot(*tour.T, color=TRUE, lw=1.4)
    column[0].set_title(f"{_name(each)}, {environment.area_km2:.2f} km²", fontsize=9, color=INK)
    for axes, method, label in (
        (column[1], "none", "as learned"),
        (column[2], "heading", "with loop and headings corrected"),
    ):
        _streets(axes, each)
        axes.plot(*one.road_m[method].T, ".", ms=1.2, color=COLOURS[method], alpha=0.5, zorder=2)
        axes.plot(*one.path_m[method].T, color=COLOURS[method], lw=1.2, zorder=3)
        axes.plot(*one.buildings_m[method].T, "s", ms=6, color=OBJECT, mec="white", zorder=5)
        lines = np.stack([environment.buildings_m, one.buildings_m[method]], axis=1)
        axes.add_collection(
            LineCollection(list(lines), colors=OBJECT, linewidths=0.8, linestyles="dotted")
        )
        axes.set_title(f"{label}: {one.error_km2[method]:.2f} km²", fontsize=9, color=INK)
        reach.append(one.path_m[method])
    ends = np.vstack(reach)
    for axes in column:
        axes.plot(*environment.buildings_m.T, "s", ms=5, color=TRUE, mec="white", zorder=4)
        axes.set_xlim(ends[:, 0].min() - MARGIN_M, ends[:, 0].max() + MARGIN_M)
        axes.set_ylim(ends[:, 1].min() - MARGIN_M, ends[:, 1].max() + MARGIN_M)
        axes.set_aspect("equal", adjustable="box")
        remove_scales(axes)
    left, bottom = ends.min(axis=0) - 0.6 * MARGIN_M
    column[0].plot([left, left + SCALE_M], [bottom, bottom], color=INK, lw=2)
    column[0].text(
        left, bottom + 0.1 * MARGIN_M, f"{SCALE_M:g} m", fontsize=7.5, color=INK, va="bottom"
    )


def _streets(axes: Axes, each: CityMap) -> None:
    streets = each.environment.streets
    axes.add_collection(
        LineCollection(
            list(streets.points_m[streets.pieces]), colors=STREET, linewidths=0.9, zorder=0
        )
    )


def _name(each: CityMap) -> str:
    return each.environment.name.replace("_", " ")
