"""The figure of perception (paper, figure 3): camera image, depth, segments, road, and the ground
from above.
"""

from __future__ import annotations

from io import BytesIO
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from cogmap.cli.plots import draw, ground
from cogmap.cli.plots.palette import ESTIMATE, FAINT, INK, KERB, PAPER, ROAD, ROAD_OPACITY
from cogmap.recording.views import Depth, Image
from cogmap.schemas.sensing import Percepts, View

PALER = 0.55
# Without the time of day in it, the same log gives the same bytes.
_UNDATED: dict[str, dict[str, Any]] = {".pdf": {"CreationDate": None}}
# A view that is wider than so many times its height is shown larger: the four are below each other.
WIDE = 2.0
MOSAIC: Any = [["camera", "depth", "plan"], ["segments", "road", "plan"]]
WIDE_MOSAIC: Any = [["camera", "plan"], ["depth", "plan"], ["segments", "plan"], ["road", "plan"]]


def figure(
    view: View, image: Image, depth_m: Depth, percepts: Percepts, title: str, suffix: str
) -> bytes:
    """Draw the figure, as a file of the kind that `suffix` names."""
    with mpl.rc_context(draw.STYLE):
        layout = ConstrainedLayoutEngine(h_pad=0.08, w_pad=0.05)
        height_px, width_px = image.shape[:2]
        is_wide = width_px > WIDE * height_px
        size_in = (13.0, 9.4) if is_wide else (13.0, 7.3)
        sheet = Figure(figsize=size_in, dpi=130, facecolor=PAPER, layout=layout)
        mosaic = WIDE_MOSAIC if is_wide else MOSAIC
        ratios = [1.15, 0.92] if is_wide else [1, 1, 0.92]
        panels = sheet.subplot_mosaic(mosaic, width_ratios=ratios)
        draw.show(panels["camera"], image)
        shown = draw.show_depth(panels["depth"], depth_m, view.calibration)
        draw.add_scale(panels["depth"].inset_axes((1.02, 0.0, 0.035, 0.9)), shown)
        pale = _paler(image)
        draw.show(panels["segments"], pale)
        draw.draw_objects(panels["segments"], percepts.objects, 0.5)
        draw.show(panels["road"], pale)
        ground.draw_road_in_image(panels["road"], percepts, view.calibration)
        ground.draw_plan(panels["plan"], percepts, view.calibration)
        _dress(sheet, panels, percepts, title)
        sheet.draw_without_rendering()
        sheet.set_layout_engine("none")
        ground.fit_plan(panels["plan"], percepts)
        draw.name_objects(panels["segments"], percepts.objects, 7.5)
        ground.name_in_plan(panels["plan"], percepts.objects, 8.5)
        file = BytesIO()
        sheet.savefig(file, format=suffix[1:], facecolor=PAPER, metadata=_UNDATED.get(suffix))
    return file.getvalue()


def _paler(image: Image) -> Image:
    """Make an image greyer and lighter, so that what is drawn over it stands out."""
    grey = image.mean(axis=2, keepdims=True)
    return np.asarray(255 - PALER * (255 - (0.75 * grey + 0.25 * image)), np.uint8)


def _dress(sheet: Figure, panels: dict[str, Axes], percepts: Percepts, title: str) -> None:
    """Set titles, ticks and the legend."""
    places = [
        f", a place seen in frame {match.frame} ({match.score:.2f})" for match in percepts.matches
    ]
    captions = {
        "camera": "camera image" + "".join(places),
        "depth": "depth",
        "segments": "segments: name, activation, distance",
        "road": "road in the image",
        "plan": "road and objects on the ground",
    }
    for letter, (name, caption) in zip("abcde", captions.items(), strict=True):
        panels[name].set_title(f"{letter}   {caption}", loc="left", color=INK, fontsize=10)
        if name != "plan":
            panels[name].set(xticks=[], yticks=[])
    panels["plan"].tick_params(colors=FAINT, length=3)
    panels["plan"].set_xlabel("metres right of the robot", color=FAINT)
    panels["plan"].set_ylabel("metres ahead", color=FAINT)
    panels["plan"].set_facecolor(PAPER)
    sheet.suptitle(title, x=0.01, ha="left", color=INK, fontsize=14, fontweight="bold")
    sheet.legend(handles=_legend(), loc="outside lower left", ncols=4, frameon=False, fontsize=8.5)


def _legend() -> list[Patch | Line2D]:
    return [
        Patch(fc=KERB, label="depth unknown"),
        Patch(fc=ROAD, alpha=ROAD_OPACITY, label="road"),
        Line2D([], [], marker="o", ls="", ms=4, mfc=ESTIMATE, mec="white", label="where it ends"),
        Line2D(
            [], [], marker="o", ls="", mfc=INK, mec="white", label="centre and 2 SD of each object"
        ),
    ]
