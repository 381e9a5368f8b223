"""What is drawn of a view: the image, its depth in colours, segments with names."""

from __future__ import annotations

import logging
from typing import Any

import cv2
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Polygon
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from cogmap.cli.plots.labels import Label, place
from cogmap.cli.plots.palette import FAINT, KERB, PAPER, SEVERAL
from cogmap.recording.views import Depth, Image
from cogmap.schemas.sensing import Calibration, Percept

logging.getLogger("matplotlib").setLevel(logging.WARNING)
STYLE: dict[Any, Any] = {"font.family": "sans-serif", "font.size": 9, "axes.edgecolor": KERB}
WIDE_PX = 960
SCALE_PX = 90
DPI = 100
NEAREST_SHARE = 0.01
MIN_DISPARITY_PX = 2.0
TICKS = (1.0, 2.0, 5.0)


def encode_image(image: Image, suffix: str) -> bytes:
    """Encode an image as a file of the kind that `suffix` names."""
    _, data = cv2.imencode(suffix, cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    return data.tobytes()


def draw_view(
    image: Image, depth_m: Depth | None, camera: Calibration, objects: list[Percept]
) -> Image:
    """Draw the image, or `depth_m` with a scale beside it, each pixel several wide, and over it
    `objects`.
    """
    height, width = image.shape[:2] if depth_m is None else depth_m.shape
    times = max(1, round(WIDE_PX / width))
    wide_px = width * times
    high_px = height * times
    whole_px = wide_px + (SCALE_PX if depth_m is not None else 0)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(whole_px / DPI, high_px / DPI), dpi=DPI, facecolor=PAPER)
        axes = figure.add_axes((0, 0, wide_px / whole_px, 1))
        axes.set_axis_off()
        if depth_m is None:
            show(axes, image)
        else:
            scale = figure.add_axes(
                (1 - 0.85 * SCALE_PX / whole_px, 0.06, 0.2 * SCALE_PX / whole_px, 0.82)
            )
            add_scale(scale, show_depth(axes, depth_m, camera))
        draw_objects(axes, objects, 0.25 if depth_m is None else 0.0)
        name_objects(axes, objects, 10)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba(), np.uint8)[..., :3].copy()


def show(axes: Axes, image: Image) -> None:
    """Draw an image, each pixel a square."""
    axes.imshow(image, interpolation="nearest", aspect="equal")


def show_depth(axes: Axes, depth_m: Depth, camera: Calibration) -> AxesImage:
    """Draw depth in colours that go by its logarithm, as far as it is measured by some pixels of
    disparity; unknown depth is grey.
    """
    known = depth_m[depth_m > 0]
    nearest_m = float(np.quantile(known, NEAREST_SHARE)) if known.size else 1.0
    farthest_m = camera.fx_px * camera.baseline_m / MIN_DISPARITY_PX
    norm = LogNorm(nearest_m, max(farthest_m, 2 * nearest_m))
    colours = mpl.colormaps["viridis_r"].with_extremes(bad=KERB)
    return axes.imshow(
        np.ma.masked_less_equal(depth_m, 0), cmap=colours, norm=norm, interpolation="nearest"
    )


def add_scale(scale: Axes, shown: AxesImage) -> Colorbar:
    """Draw in the axes `scale` which depth a colour of `shown` is."""
    figure = scale.get_figure(root=True)
    assert figure is not None
    bar = figure.colorbar(shown, cax=scale, extend="both", ticks=LogLocator(subs=TICKS))
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda metres, _: f"{metres:g}"))
    bar.ax.yaxis.set_minor_formatter(NullFormatter())
    bar.ax.tick_params(which="both", colors=FAINT, length=3)
    bar.ax.set_title("m", color=FAINT, fontsize=9)
    bar.outline.set_visible(False)
    return bar


def colours_of(objects: list[Percept]) -> list[str]:
    """Choose a colour for each, the same wherever they are drawn."""
    return [SEVERAL[number % len(SEVERAL)] for number in range(len(objects))]


def draw_objects(axes: Axes, objects: list[Percept], opacity: float) -> None:
    """Draw what is seen of each object, filled and outlined."""
    for percept, colour in zip(objects, colours_of(objects), strict=True):
        corners = outline_px(percept)
        axes.add_patch(
            Polygon(corners, closed=True, fc=colour, ec="none", alpha=opacity, zorder=10)
        )
        axes.add_patch(
            Polygon(
                corners, closed=True, fill=False, ec=colour, lw=1.8, joinstyle="round", zorder=11
            )
        )


def name_objects(axes: Axes, objects: list[Percept], size: float) -> None:
    """Write each object's name, if it has one, its activation and its distance. The layout must be
    settled.
    """
    labels = []
    for percept, colour in zip(objects, colours_of(objects), strict=True):
        corners = outline_px(percept)
        x = float(corners[:, 0].min() + corners[:, 0].max()) / 2
        y = float(corners[:, 1].min())
        text = f"{percept.activation:.2f} · {percept.range_m:.1f} m"
        if percept.name:
            text = f"{spoken(percept.name)}\n{text}"
        labels.append(Label(text, x, y, colour))
    place(axes, labels, size, chips=True)


def spoken(name: str) -> str:
    """Write a name as people do."""
    return name.replace("_", " ")


def outline_px(percept: Percept) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return corners (n, 2), column and row, of the outline, or of the box if there is none."""
    if len(percept.outline_px) > 2:
        return np.array(percept.outline_px, np.float64)
    left, top, width, height = percept.box_px
    right = left + width - 1
    bottom = top + height - 1
    return np.array([(left, top), (right, top), (right, bottom), (left, bottom)], np.float64)
