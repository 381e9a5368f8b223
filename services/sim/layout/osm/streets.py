"""The streets of an OpenStreetMap extract, as roads from crossing to crossing. Pure."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from itertools import pairwise

import cv2
import numpy as np

from cogmap.data.osm import Extract, Tags, Way
from cogmap.geometry.arrays import Floats
from cogmap.services.sim.layout.plan import Point, Road

# Usual widths between the kerbs, by the value of `highway`; other ways carry no cars.
WIDTHS_M = {
    "trunk": 11.0,
    "primary": 10.0,
    "secondary": 9.0,
    "tertiary": 8.0,
    "unclassified": 6.5,
    "residential": 6.5,
    "living_street": 5.5,
    "pedestrian": 5.5,
    "road": 6.0,
    "service": 4.5,
}
# Bounds against mistyped widths.
NARROWEST_M = 3.0
WIDEST_M = 30.0
# A bend that leaves the straight line by less is straightened.
STRAIGHT_M = 0.4

Positions = dict[int, Point]


# A length as mappers write it: metres unless it names feet (wiki.openstreetmap.org, Map features/
# Units), "~" and "+" allowed.
FOOT_M = 0.3048
INCH_M = 0.0254
_LENGTH = re.compile(
    r"~?\s*(?P<number>\d+(?:[.,]\d+)?)\s*"
    r"(?:m|metres?|meters?|(?P<feet>ft|foot|feet|')\s*(?:(?P<inches>\d+(?:[.,]\d+)?)\s*(?:\"|''|in))?)?"
    r"\s*\+?"
)


def is_street(way: Way) -> bool:
    """Decide whether cars may drive along a way, in the open and on the ground."""
    tags = way.tags
    if _kind(tags) not in WIDTHS_M or tags.get("area") == "yes":
        return False

    in_tunnel = tags.get("tunnel", "no") != "no"
    is_covered = tags.get("covered", "no") != "no"
    return not in_tunnel and not is_covered


def width_m(tags: Tags) -> float:
    """Return the width that a way is tagged with or, without, the usual one of its kind."""
    width = metres(tags.get("width", ""))
    if width is None:
        width = WIDTHS_M[_kind(tags)]

    return min(WIDEST_M, max(NARROWEST_M, width))


def _kind(tags: Tags) -> str:
    """Return a way's value of `highway`; a link is of the kind that it leads to."""
    return tags.get("highway", "").removesuffix("_link")


def metres(text: str) -> float | None:
    """Return the metres that a tag gives, such as "7.5", "7.5 m" or "24'6\"", of several such as
    "2;3" the most; None if it gives none.
    """
    found = [_LENGTH.fullmatch(value.strip()) for value in text.split(";")]
    lengths_m = []
    for length in found:
        if length is None:
            return None
        unit_m = FOOT_M if length["feet"] else 1.0
        value_m = unit_m * float(length["number"].replace(",", "."))
        value_m += INCH_M * float((length["inches"] or "0").replace(",", "."))
        lengths_m.append(value_m)

    most_m = max(lengths_m)
    return most_m if 0.0 < most_m < 1000.0 else None


def roads(extract: Extract, at_m: Positions) -> list[Road]:
    """Make the roads of an extract whose nodes are `at_m`: of a street that bends between two
    crossings several of one name, such as "Rue Grimaldi 3".
    """
    ways = [way for way in extract.ways if is_street(way)]
    uses: Counter[int] = Counter()
    for way in ways:
        for piece in extract.pieces(way):
            uses.update(piece)

    numbers: Counter[str] = Counter()
    found = []
    for way in ways:
        kind = way.tags["highway"]
        title = way.tags.get("name", f"{kind} way")
        for piece in extract.pieces(way):
            for stretch in _stretches(piece, uses):
                numbers[title] += 1
                line_m = np.array([at_m[node] for node in stretch])
                found += _straight(f"{title} {numbers[title]}", line_m, width_m(way.tags))

    return found


def _stretches(nodes: list[int], uses: Counter[int]) -> Iterable[list[int]]:
    """Cut a way at the nodes that others share with it."""
    stretch = nodes[:1]
    for node in nodes[1:]:
        stretch.append(node)
        if uses[node] > 1:
            yield stretch
            stretch = [node]

    if len(stretch) > 1:
        yield stretch


def _straight(name: str, line_m: Floats, width: float) -> list[Road]:
    """Make a road of each straight piece of a line."""
    parts_m = [line_m]
    if (line_m[0] == line_m[-1]).all():
        # Between the ends of a ring is no straight line that a bend could leave: it is halved.
        farthest = int(np.hypot(*(line_m - line_m[0]).T).argmax())
        parts_m = [line_m[: farthest + 1], line_m[farthest:]]

    pieces = []
    for part_m in parts_m:
        contour = part_m.astype(np.float32)[:, None]
        corners = cv2.approxPolyDP(contour, STRAIGHT_M, closed=False)
        corners_m: list[Point] = [(round(x, 2), round(y, 2)) for x, y in corners[:, 0].tolist()]
        for start, end in pairwise(corners_m):
            if start != end:
                pieces.append(Road(name, start, end, width))

    return pieces
