"""Guidance schemes as TOML, as a file of schemes has them. Pure."""

from __future__ import annotations

import json
from collections.abc import Iterable

from cogmap.schemas.cognition import GuidanceScheme


def written(schemes: Iterable[GuidanceScheme]) -> str:
    """Write the text, to a millimetre and a tenth of a milliradian."""
    return "\n".join(_table(scheme) for scheme in schemes)


def _table(scheme: GuidanceScheme) -> str:
    lines = ["[[guidance]]", f"name = {json.dumps(scheme.name)}", "landmarks = ["]
    for landmark in scheme.landmarks:
        look = json.dumps(landmark.look)
        stands = f"range_m = {landmark.range_m:.3f}, bearing_rad = {landmark.bearing_rad:.4f}"
        lines.append(f"    {{ look = {look}, {stands} }},")

    path = ", ".join(f"[{ahead_m:.3f}, {left_m:.3f}]" for ahead_m, left_m in scheme.path_m)
    lines += [
        "]",
        f"path_m = [{path}]",
        f"executions = {scheme.executions}",
        f"successes = {scheme.successes}",
        "",
    ]
    return "\n".join(lines)
