"""Places that a map marks by a sign, the same in its picture and in its legend."""

from __future__ import annotations

from typing import Any

from cogmap.cli.plots.palette import CHARGING, GOAL, INK, TRUE

START_MARKER: dict[str, Any] = {
    "marker": "o",
    "ms": 13,
    "ls": "",
    "mfc": "white",
    "mec": TRUE,
    "mew": 2,
}
END_MARKER: dict[str, Any] = {
    "marker": "s",
    "ms": 8,
    "ls": "",
    "mfc": TRUE,
    "mec": "white",
    "mew": 1.2,
}
# A plus, filled.
CHARGING_MARKER: dict[str, Any] = {"marker": "P", "ms": 9, "ls": "", "color": CHARGING}


def goal_marker(is_reached: bool) -> dict[str, Any]:
    """Return the star of a goal, which is filled if it is reached."""
    face = GOAL if is_reached else "white"
    return {"marker": "*", "ms": 14, "ls": "", "mfc": face, "mec": INK, "mew": 1.0}
