"""The picture of one cognitive cycle: its stages as boxes from left to right, with their times."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle

from cogmap.cli.explain import reasons, text
from cogmap.cli.explain.drawing import deciding, sensing
from cogmap.cli.explain.drawing.blocks import Words
from cogmap.cli.explain.drawing.box import LARGE, PAD_IN, Box, inner_in
from cogmap.cli.explain.drawing.lettering import wrapped
from cogmap.cli.explain.moment import Moment
from cogmap.cli.plots import draw
from cogmap.cli.plots.palette import FAINT, INK, KERB, PAPER, WALL
from cogmap.recording import views
from cogmap.recording.views import Image

GAP_IN = 0.3
EDGE_IN = 0.3
TITLE_IN = 0.75
HEAD_IN = 0.42
TIMES_IN = 0.65
STRIP_IN = 0.09
MIN_HEIGHT_IN = 2.6
DPI = 120
SIZE_OF_WHY = 9.5
# Without the time of day and random names in it, the same log gives the same bytes.
_UNDATED: dict[str, dict[str, Any]] = {".svg": {"Date": None}}
_STYLE: dict[Any, Any] = {**draw.STYLE, "svg.hashsalt": "cogmap", "text.parse_math": False}


def figure(moment: Moment, suffix: str) -> bytes:
    """Draw a file of the kind that `suffix` names. Raises LogError if the view is no image."""
    image = _image(moment)
    aspect = 0.0 if image is None else image.shape[0] / image.shape[1]
    stages = [
        sensing.sensed(moment, aspect),
        sensing.percepts(moment),
        sensing.workspace(moment),
        deciding.coalitions(moment),
        deciding.broadcast(moment),
        deciding.behaviours(moment),
        deciding.command(moment),
    ]
    width_in = sum(box.width_in for box in stages) + GAP_IN * (len(stages) - 1) + 2 * EDGE_IN

    lines = []
    for sentences in (reasons.of_competition(moment), reasons.of_action(moment)):
        lines += wrapped(" ".join(sentences), width_in - 2 * EDGE_IN, SIZE_OF_WHY)
    why = Words(lines, SIZE_OF_WHY)

    inner_in = max(MIN_HEIGHT_IN, *(box.height_in for box in stages))
    box_in = inner_in + HEAD_IN + PAD_IN
    height_in = TITLE_IN + box_in + TIMES_IN + why.height_in + EDGE_IN

    with mpl.rc_context(_STYLE):
        sheet = Figure(figsize=(width_in, height_in), dpi=DPI, facecolor=PAPER)
        axes = sheet.add_axes((0, 0, 1, 1))
        axes.set(xlim=(0, width_in), ylim=(0, height_in))
        axes.set_axis_off()
        base_in = height_in - 0.45
        axes.text(
            EDGE_IN,
            base_in,
            text.headline(moment).capitalize(),
            color=INK,
            fontsize=14,
            fontweight="bold",
        )
        note = f"{moment.path.name}; times are since the view was taken"
        axes.text(width_in - EDGE_IN, base_in, note, ha="right", color=FAINT, fontsize=9)
        _draw_boxes(axes, stages, height_in - TITLE_IN, box_in)
        if image is not None:
            _draw_view(sheet, moment, image, height_in - TITLE_IN - HEAD_IN)
        _draw_times(axes, stages, width_in, why.height_in + EDGE_IN + TIMES_IN / 2)
        why.draw(axes, EDGE_IN, why.height_in + EDGE_IN, width_in)
        file = BytesIO()
        sheet.savefig(file, format=suffix[1:], facecolor=PAPER, metadata=_UNDATED.get(suffix))
    return file.getvalue()


def _image(moment: Moment) -> Image | None:
    """Return the view; None if the log has none. Raises LogError if it is no image."""
    if moment.view is None:
        return None

    view = moment.view.message
    return views.image(view.image, f"{moment.path}, frame {view.frame}")


def _draw_boxes(axes: Axes, stages: list[Box], top_in: float, box_in: float) -> None:
    """Draw each box with what stands in it, and an arrow to the next."""
    left_in = EDGE_IN
    for box in stages:
        if box is not stages[0]:
            y_in = top_in - HEAD_IN / 2
            arrow = FancyArrowPatch(
                (left_in - GAP_IN + 0.03, y_in),
                (left_in - 0.03, y_in),
                arrowstyle="-|>",
                mutation_scale=11,
                color=FAINT,
                lw=1.4,
                shrinkA=0,
                shrinkB=0,
            )
            axes.add_patch(arrow)
        _draw_frame(axes, box, left_in, top_in, box_in)
        below_in = top_in - HEAD_IN - box.image_in
        for block in box.blocks:
            block.draw(axes, left_in + PAD_IN, below_in, box.inner_in)
            below_in -= block.height_in
        left_in += box.width_in + GAP_IN


def _draw_frame(axes: Axes, box: Box, left_in: float, top_in: float, box_in: float) -> None:
    frame = FancyBboxPatch(
        (left_in, top_in - box_in),
        box.width_in,
        box_in,
        boxstyle="round,pad=0,rounding_size=0.08",
        fc=PAPER if box.is_empty else "white",
        ec=WALL if box.is_empty else KERB,
        ls=(0, (4, 3)) if box.is_empty else "-",
        lw=1.0,
    )
    axes.add_patch(frame)
    title = Words([box.title], LARGE, box.colour, is_bold=True)
    title.draw(axes, left_in + PAD_IN, top_in - 0.1, box.inner_in)
    delay = text.delay(box.after_ms)
    axes.text(
        left_in + box.width_in - PAD_IN,
        top_in - 0.1 - 0.8 * title.height_in,
        delay,
        ha="right",
        color=FAINT,
        fontsize=8.5,
    )


def _draw_times(axes: Axes, stages: list[Box], width_in: float, y_in: float) -> None:
    """Draw a strip as long as the cycle, in which each stage has its share of the time."""
    done_ms = [box.after_ms for box in stages if box.after_ms is not None]
    last_ms = max(done_ms, default=0.0)
    if last_ms <= 0.0:
        return

    label_in = 0.75
    long_in = width_in - 2 * EDGE_IN - label_in
    before_ms = 0.0
    for box in stages:
        if box.after_ms is None or box.after_ms <= before_ms:
            continue
        start_in = EDGE_IN + long_in * before_ms / last_ms
        share_in = long_in * (box.after_ms - before_ms) / last_ms
        low_in = y_in - STRIP_IN / 2
        axes.add_patch(
            Rectangle((start_in, low_in), share_in, STRIP_IN, fc=box.colour, ec="none", alpha=0.8)
        )
        before_ms = box.after_ms

    axes.text(
        width_in - EDGE_IN,
        y_in,
        text.delay(last_ms),
        ha="right",
        va="center_baseline",
        color=FAINT,
        fontsize=8.5,
    )


def _draw_view(sheet: Figure, moment: Moment, image: Image, top_in: float) -> None:
    """Draw the view, and what was recognised in it, in the upper part of the first box."""
    wide_in = inner_in(sensing.SENSED_IN)
    high_in = wide_in * image.shape[0] / image.shape[1]
    sheet_in = sheet.get_size_inches()
    place = (
        (EDGE_IN + PAD_IN) / sheet_in[0],
        (top_in - high_in) / sheet_in[1],
        wide_in / sheet_in[0],
        high_in / sheet_in[1],
    )
    inset = sheet.add_axes(place)
    inset.set_axis_off()
    draw.show(inset, image)
    if moment.percepts is not None:
        draw.draw_objects(inset, moment.percepts.message.objects, 0.25)
