"""Labels in a picture that stay inside it and do not hide one another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.patheffects as outlines
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from cli.plots.palette import PAPER

GAP_PX = 2.0
STEPS = 60


@dataclass(frozen=True)
class Label:
    """`text` to stand above the point (x, y), which is given as the axes' data is."""

    text: str
    x: float
    y: float
    colour: str


def place(axes: Axes, labels: list[Label], size: float, chips: bool = False) -> None:
    """Write each label where there is room nearest above its point, or below, with a line to the
    point if far away.

    The layout of the figure must be settled. `chips` are white on the label's colour.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    canvas: Any = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    inside = axes.get_window_extent(renderer)
    taken = list[Bbox]()
    for label in sorted(labels, key=lambda label: (label.y, label.x, label.text)):
        text = _written(axes, label, size, chips)
        point = axes.transData.transform((label.x, label.y))
        natural = _extent(text, renderer)
        place_px = _free(
            natural.translated(0, float(point[1]) - natural.y0 + GAP_PX), inside, taken
        )
        taken.append(place_px)
        back = axes.transData.inverted()
        x, y = back.transform(
            (point[0] + place_px.x0 - natural.x0, point[1] + place_px.y0 - natural.y0)
        ).tolist()
        text.set_position((x, y))
        if max(place_px.y0 - point[1], point[1] - place_px.y1) > 3 * GAP_PX:
            nearer_px = place_px.y0 if place_px.y0 > point[1] else place_px.y1
            end = back.transform(((place_px.x0 + place_px.x1) / 2, nearer_px))
            axes.plot([label.x, end[0]], [label.y, end[1]], color=label.colour, lw=0.9, zorder=19)


def _written(axes: Axes, label: Label, size: float, chip: bool) -> Text:
    look: dict[str, Any] = {
        "ha": "center",
        "va": "bottom",
        "zorder": 20,
        "fontsize": size,
        "linespacing": 1.1,
    }
    if chip:
        box = {"boxstyle": "round,pad=0.25", "fc": label.colour, "ec": "none", "alpha": 0.92}
        return axes.text(label.x, label.y, label.text, color="white", bbox=box, **look)
    halo = [outlines.withStroke(linewidth=2.2, foreground=PAPER)]
    return axes.text(label.x, label.y, label.text, color=label.colour, path_effects=halo, **look)


def _extent(text: Text, renderer: RendererAgg) -> Bbox:
    patch = text.get_bbox_patch()
    if patch is None:
        return text.get_window_extent(renderer)
    text.update_bbox_position_size(renderer)
    return patch.get_window_extent(renderer)


def _free(box: Bbox, inside: Bbox, taken: list[Bbox]) -> Bbox:
    """Where `box` is or higher, else lower, inside, where it overlaps none of `taken`; the first
    where all do.
    """
    step = box.height / 4
    moves = [*range(STEPS), *range(-1, -STEPS, -1)]
    places = [_clamped(box.translated(0, step * move), inside) for move in moves]
    return next(
        (place for place in places if not any(_overlap(place, other) for other in taken)), places[0]
    )


def _overlap(left: Bbox, right: Bbox) -> bool:
    across = min(left.x1, right.x1) - max(left.x0, right.x0)
    up = min(left.y1, right.y1) - max(left.y0, right.y0)
    return bool(across > -GAP_PX and up > -GAP_PX)


def _clamped(box: Bbox, inside: Bbox) -> Bbox:
    across = max(inside.x0 + GAP_PX - box.x0, 0) - max(box.x1 - inside.x1 + GAP_PX, 0)
    up = max(inside.y0 + GAP_PX - box.y0, 0) - max(box.y1 - inside.y1 + GAP_PX, 0)
    return box.translated(across, up)
