"""The buildings of an OpenStreetMap extract: footprints, extruded by their height or their levels.
Pure.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from cogmap.data.osm import Extract, Tags, Way
from cogmap.geometry.arrays import Floats
from cogmap.services.sim.layout.looks import drawn_from_name
from cogmap.services.sim.layout.osm.streets import Positions, metres
from cogmap.services.sim.layout.plan import Plot

# Usual heights, of a storey and of a building without tags; bounds against mistyped heights.
LEVEL_M = 3.0
USUAL_M = 7.0
LOWEST_M = 2.5
HIGHEST_M = 120.0
# Smaller outlines are left out, and smaller bends straightened.
SMALLEST_M2 = 8.0
STRAIGHT_M = 0.2
CORNERS = 3
# As long as a name in a message may be (schemas/base.py).
MAX_NAME = 200
NO_WALLS = ("no", "roof", "carport")
# What a building is used for, by the values of its tags.
_FUNCTIONS = {
    "school": ("school", "university", "college", "kindergarten", "library", "museum", "theatre"),
    "shop": ("retail", "supermarket", "shop", "restaurant", "cafe", "kiosk", "pharmacy", "bank"),
    "works": ("industrial", "warehouse", "garage", "garages", "train_station", "fire_station"),
    "office": ("office", "commercial", "townhall", "public", "civic", "government", "church"),
    "home": ("apartments", "house", "residential", "detached", "terrace", "hotel", "dormitory"),
}


def plots(extract: Extract, at_m: Positions) -> list[Plot]:
    """Make the buildings of an extract whose nodes are `at_m`. Those without walls, and those that
    are cut off or tiny, are left out.
    """
    found = []
    names: set[str] = set()
    for way in extract.ways:
        outline_m = _outline_m(way, at_m)
        if len(outline_m) < CORNERS:
            continue

        tags = way.tags
        name = tags.get("name", f"building {way.id}")
        if "name" not in tags and "addr:housenumber" in tags and "addr:street" in tags:
            name = f"{tags['addr:street']} {tags['addr:housenumber']}"
        name = name[:MAX_NAME]
        if name in names:
            name = f"{name} ({way.id})"
        names.add(name)
        found.append(_plot(name, tags, outline_m))

    return found


def _outline_m(way: Way, at_m: Positions) -> Floats:
    """Return the corners of a building, counter-clockwise, (n, 2); none if the way is no whole
    outline of a building with walls.
    """
    is_ring = len(way.nodes) > CORNERS and way.nodes[0] == way.nodes[-1]
    has_walls = way.tags.get("building", "no") not in NO_WALLS
    if not is_ring or not has_walls or not all(node in at_m for node in way.nodes):
        return np.zeros((0, 2))

    corners_m = [at_m[node] for node in way.nodes[:-1]]
    contour = np.array(corners_m, np.float32)[:, None]
    simple = cv2.approxPolyDP(contour, STRAIGHT_M, closed=True)
    outline_m = simple[:, 0].astype(float).round(2)

    area_m2 = cv2.contourArea(simple, oriented=True)
    if abs(area_m2) < SMALLEST_M2:
        return np.zeros((0, 2))
    return outline_m if area_m2 > 0 else outline_m[::-1]


def _plot(name: str, tags: Tags, outline_m: Floats) -> Plot:
    """Make a building with the smallest rectangle around its outline. Nothing is known of what it
    looks like, so that is drawn from its name.
    """
    middle_m, size_m, degrees = cv2.minAreaRect(outline_m.astype(np.float32))
    x_m, y_m = middle_m
    length_m, width_m = size_m
    rounded_m = (round(float(length_m), 2), round(float(width_m), 2), round(height_m(tags), 2))
    return Plot(
        kind=drawn_from_name(name, rounded_m),
        x_m=round(float(x_m), 2),
        y_m=round(float(y_m), 2),
        heading_rad=math.remainder(math.radians(degrees), math.tau),
        function=function(tags),
        outline=tuple((x, y) for x, y in outline_m.tolist()),
    )


def height_m(tags: Tags) -> float:
    """Return the height that a building is tagged with, that of its levels, or the usual one."""
    height = metres(tags.get("height", ""))
    levels = metres(tags.get("building:levels", ""))
    if height is None:
        height = USUAL_M if levels is None else LEVEL_M * levels

    return min(HIGHEST_M, max(LOWEST_M, height))


def function(tags: Tags) -> str:
    """Return what a building is for: a shop, a school, an office, works, or otherwise a home."""
    if "shop" in tags:
        return "shop"

    values = {tags.get(key, "") for key in ("building", "amenity", "tourism", "office")}
    for name, words in _FUNCTIONS.items():
        if not values.isdisjoint(words):
            return name

    return "home"
