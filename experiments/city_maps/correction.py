"""How map correction is set up in this experiment: off, as the paper has it, or with headings
(paper §5.6, eq. 5-9).
"""

from __future__ import annotations

from cogmap.runtime.config import Sections

METHODS = ("none", "positions", "heading")
NEVER_S = 1e9
PLACE_SD_M = 2.5
PLACE_SD_RAD = 0.05


def settings(method: str, step_m: float) -> Sections:
    """The keys of the workspace and its codelets for one of METHODS, where views are `step_m`
    apart.
    """
    # What is felt of a step varies: with half of it, each view has its place on the path.
    spacing = {"path_spacing_m": step_m / 2}
    codelets = {**spacing, "place_match_sd_m": PLACE_SD_M, "place_match_sd_rad": PLACE_SD_RAD}
    if method == "none":
        return {"workspace": spacing | {"revisit_s": NEVER_S}, "codelets": codelets}
    return {"workspace": spacing, "codelets": codelets | {"correct": method}}
