"""The streets of an OpenStreetMap extract, as roads from crossing to crossing. Pure."""

from __future__ import annotations

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
NARROWEST_M = 3.0
WIDEST_M = 30.0
# A bend that leaves the straight line by less is straightened.
STRAIGHT_M = 0.4
_LINK = "_link"

Positions = dict[int, Point]


def is_street(way: Way) -> bool:
    """Whether cars may drive along a way, in the open and on the ground."""
    tags = way.tags
    if _kind(tags) not in WIDTHS_M or tags.get("area") == "yes":
        return False

    in_tunnel = tags.get("tunnel", "no") != "no"
    is_covered = tags.get("covered", "no") != "no"
    return not in_tunnel and not is_covered


def width_m(tags: Tags) -> float:
    """The width that a way is tagged with or, where it is not, the usual one of its kind."""
    width = metres(tags.get("width", ""))
    if width is None:
        width = WIDTHS_M[_kind(tags)]

    return min(WIDEST_M, max(NARROWEST_M, width))


def _kind(tags: Tags) -> str:
    """Its value of `highway`; a link is of the kind that it leads to."""
    return tags.get("highway", "").removesuffix(_LINK)


def metres(text: str) -> float | None:
    """The metres that a tag gives, such as "7.5" or "7.5 m"; None where it gives none."""
    number = text.strip().removesuffix("m").strip().replace(",", ".")
    try:
        value = float(number)
    except ValueError:
        return None

    return value if 0.0 < value < 1000.0 else None


def roads(extract: Extract, at_m: Positions) -> list[Road]:
    """The roads of an extract whose nodes are `at_m`: of a street that bends between two crossings
    several of one name, such as "Rue Grimaldi 3".
    """
    ways = [way for way in extract.ways if is_street(way)]
    uses: Counter[int] = Counter()
    for way in ways:
        uses.update(_known(way, at_m))

    numbers: Counter[str] = Counter()
    found = []
    for way in ways:
        kind = way.tags["highway"]
        title = way.tags.get("name", f"{kind} way")
        for stretch in _stretches(_known(way, at_m), uses):
            numbers[title] += 1
            name = f"{title} {numbers[title]}"
            line_m = np.array([at_m[node] for node in stretch])
            found += _straight(name, line_m, width_m(way.tags))

    return found


def _known(way: Way, at_m: Positions) -> list[int]:
    """The nodes of a way whose positions are known."""
    return [node for node in way.nodes if node in at_m]


def _stretches(nodes: list[int], uses: Counter[int]) -> Iterable[list[int]]:
    """A way, cut at the nodes that others share with it."""
    stretch = nodes[:1]
    for node in nodes[1:]:
        stretch.append(node)
        if uses[node] > 1:
            yield stretch
            stretch = [node]

    if len(stretch) > 1:
        yield stretch


def _straight(name: str, line_m: Floats, width: float) -> list[Road]:
    """A road for each straight piece of a line."""
    contour = line_m.astype(np.float32)[:, None]
    corners = cv2.approxPolyDP(contour, STRAIGHT_M, closed=False)
    corners_m: list[Point] = [(round(x, 2), round(y, 2)) for x, y in corners[:, 0].tolist()]

    pieces = []
    for start, end in pairwise(corners_m):
        if start != end:
            pieces.append(Road(name, start, end, width))

    return pieces
