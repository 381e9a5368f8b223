"""Guidance schemes as TOML, as a file of schemes has them. Pure."""

from __future__ import annotations

import json
from collections.abc import Iterable

from cogmap.schemas.cognition import GuidanceScheme, Relation


def written(schemes: Iterable[GuidanceScheme]) -> str:
    """The text, to a millimetre and a tenth of a milliradian."""
    return "\n".join(_table(scheme) for scheme in schemes)


def _table(scheme: GuidanceScheme) -> str:
    lines = ["[[guidance]]", f"name = {json.dumps(scheme.name)}", "landmarks = ["]
    lines += [f"    {_landmark(landmark)}," for landmark in scheme.landmarks]
    path = ", ".join(f"[{ahead_m:.3f}, {left_m:.3f}]" for ahead_m, left_m in scheme.path_m)
    lines += [
        "]",
        f"path_m = [{path}]",
        f"executions = {scheme.executions}",
        f"successes = {scheme.successes}",
        "",
    ]
    return "\n".join(lines)


def _landmark(landmark: Relation) -> str:
    look = json.dumps(landmark.look)
    range_m = f"{landmark.range_m:.3f}"
    bearing_rad = f"{landmark.bearing_rad:.4f}"
    return f"{{ look = {look}, range_m = {range_m}, bearing_rad = {bearing_rad} }}"
