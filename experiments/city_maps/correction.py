"""The methods of map correction that are compared (paper §5.6, eq. 5-9)."""

from __future__ import annotations

from cogmap.runtime.config import Sections
from cogmap.services.codelets.rules import OURS, positions_rule, with_rules

POSITIONS = "positions"
HEADING = "heading"
# No loop is closed; positions only, as in the paper; headings too.
METHODS = ("none", POSITIONS, HEADING)
NEVER_S = 1e9
PLACE_SD_M = 2.5
PLACE_SD_RAD = 0.05


def settings(method: str, step_m: float, rules: str = OURS) -> Sections:
    """Return the keys of the codelets for one of METHODS, by a preset of rules; views are `step_m`
    apart.
    """
    # The measured length of a step varies: with half of it, each view has its place on the path.
    codelets: dict[str, float | str] = {
        "path_spacing_m": step_m / 2,
        "place_match_sd_m": PLACE_SD_M,
        "place_match_sd_rad": PLACE_SD_RAD,
        "landmarks": "buildings",
        # The whole path is evaluated.
        "sparse_after_s": NEVER_S,
    }

    if method == "none":
        codelets["revisit_s"] = NEVER_S
    else:
        codelets["correct"] = positions_rule(rules) if method == POSITIONS else method

    return with_rules({"codelets": codelets}, rules)
