"""The districts of a town: parts whose buildings share a style and, most of them, a function.
Pure.
"""

from __future__ import annotations

import colorsys
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cogmap.services.sim.layout.blocks.streets import Grid
from cogmap.services.sim.layout.catalogue import CATALOGUE, FLAT_M, GABLE_M, BuildingType, Colour
from cogmap.services.sim.layout.plan import Point

# Made up: the share of buildings with their district's function; how many districts there are, by
# the side of the grid; choices of their places, of which the one farthest apart is kept.
OWN_FUNCTION = 0.85
MIN_DISTRICTS = 3
METRES_A_DISTRICT = 75.0
TRIES = 24
FUNCTIONS: dict[str, tuple[str, ...]] = {
    "shop": (
        "bakery",
        "pharmacy",
        "florist",
        "cafe",
        "greengrocer",
        "bookshop",
        "toy_shop",
        "tailor",
    ),
    "home": ("farmhouse", "hotel"),
    "school": ("school", "library", "museum", "theatre", "cinema"),
    "office": ("town_hall", "post_office", "bank", "police_station", "clinic"),
    "works": ("workshop", "brewery", "boathouse", "fire_station"),
}
FUNCTION_OF = {name: function for function, names in FUNCTIONS.items() for name in names}
CATALOGUE_BY_NAME = {kind.name: kind for kind in CATALOGUE}
_NAMES = {
    "shop": "Old Market",
    "home": "Garden Hill",
    "school": "College Quarter",
    "office": "City Centre",
    "works": "Canal Side",
}
# Least and most width, depth and height in metres.
_SIZES_M: dict[str, tuple[Colour, Colour]] = {
    "shop": ((7, 7, 5), (10, 9, 9)),
    "home": ((6, 6, 5), (9, 9, 8)),
    "school": ((10, 8, 6), (14, 10, 10)),
    "office": ((9, 8, 9), (13, 10, 14)),
    "works": ((10, 8, 5), (13, 10, 8)),
}
_PATTERNS = ("bands", "stripes", "columns", "checker", "planks", "timber", "grid", "shutters")
_ROOFS: tuple[Colour, ...] = ((158, 72, 50), (74, 82, 98), (96, 168, 142), (170, 142, 86))
_TRIMS: tuple[Colour, ...] = ((240, 238, 232), (236, 222, 186), (196, 188, 172), (52, 48, 50))


@dataclass(frozen=True)
class Style:
    """What the buildings of a district look like: hues from 0 to 1, two patterns, roof, trim."""

    wall_hue: float
    accent_hue: float
    patterns: tuple[str, str]
    roof: Colour
    trim: Colour
    gabled: float


@dataclass(frozen=True)
class District:
    """A part of a town; `middle` is the point that its blocks are nearest to."""

    name: str
    function: str
    middle: Point
    style: Style


@dataclass(frozen=True)
class Districts:
    """The districts of a grid's blocks. What lies outside the grid belongs to the nearest block."""

    grid: Grid
    all: tuple[District, ...]

    def at(self, x_m: float, y_m: float) -> District:
        """Return the district of a place."""
        middle_x = _block_middle(self.grid.x_m, x_m)
        middle_y = _block_middle(self.grid.y_m, y_m)
        middle = (middle_x, middle_y)

        return min(self.all, key=lambda district: _apart_m2(district.middle, middle))


def _block_middle(lines_m: tuple[float, ...], at_m: float) -> float:
    """Return the middle of the block between two lines that holds or is nearest to `at_m`."""
    after = int(np.searchsorted(lines_m, at_m))
    last = min(max(after, 1), len(lines_m) - 1)

    begin_m = lines_m[last - 1]
    end_m = lines_m[last]
    return (begin_m + end_m) / 2


def divide(rng: np.random.Generator, grid: Grid) -> Districts:
    """Return MIN_DISTRICTS districts at least, more in a larger town."""
    span_m = grid.x_m[-1] - grid.x_m[0]
    wanted = round(span_m / METRES_A_DISTRICT)
    count = min(len(FUNCTIONS), max(MIN_DISTRICTS, wanted))

    shuffled = rng.permutation(list(FUNCTIONS))
    functions = [str(function) for function in shuffled[:count]]
    middles = _spread(rng, grid, count)
    first_hue = float(rng.random())

    districts = []
    for number, function in enumerate(functions):
        hue = (first_hue + number / count) % 1.0
        style = _style(rng, hue)
        districts.append(District(_NAMES[function], function, middles[number], style))

    return Districts(grid, tuple(districts))


def _spread(rng: np.random.Generator, grid: Grid, count: int) -> list[Point]:
    """Draw the middles of `count` blocks: of some tries those that are farthest apart."""
    middles = []
    for x_m in grid.x_m[1:]:
        for y_m in grid.y_m[1:]:
            middle = (_block_middle(grid.x_m, x_m), _block_middle(grid.y_m, y_m))
            middles.append(middle)

    best: list[Point] = []
    widest_m2 = -1.0
    for _ in range(TRIES):
        numbers = rng.choice(len(middles), count, replace=False).tolist()
        chosen = [middles[number] for number in numbers]
        apart_m2 = min(_apart_m2(a, b) for a, b in combinations(chosen, 2))
        if apart_m2 > widest_m2:
            best = chosen
            widest_m2 = apart_m2

    return best


def _apart_m2(a: Point, b: Point) -> float:
    a_x, a_y = a
    b_x, b_y = b
    return (a_x - b_x) ** 2 + (a_y - b_y) ** 2


def _style(rng: np.random.Generator, hue: float) -> Style:
    first, second = rng.choice(len(_PATTERNS), 2, replace=False).tolist()
    accent_hue = (hue + float(rng.uniform(0.3, 0.7))) % 1.0

    return Style(
        wall_hue=hue,
        accent_hue=accent_hue,
        patterns=(_PATTERNS[first], _PATTERNS[second]),
        roof=_ROOFS[int(rng.integers(len(_ROOFS)))],
        trim=_TRIMS[int(rng.integers(len(_TRIMS)))],
        gabled=float(rng.choice([0.0, 0.5, 1.0])),
    )


class Builder:
    """Kinds of building for each district, none twice: those of the catalogue by their own names,
    others invented in the district's style.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._counts: dict[str, int] = {}
        self._free: dict[str, list[str]] = {}

        for function, names in FUNCTIONS.items():
            shuffled = rng.permutation(names)
            self._free[function] = [str(name) for name in shuffled]

    def next(self, district: District) -> BuildingType:
        """Choose a kind that the district may have next."""
        function = district.function
        if self._rng.random() >= OWN_FUNCTION:
            function = str(self._rng.choice(list(FUNCTIONS)))

        free = self._free[function]
        if free and self._rng.random() < 0.3:
            return CATALOGUE_BY_NAME[free.pop()]

        count = self._counts.get(function, 0) + 1
        self._counts[function] = count
        return _invent(self._rng, f"{function}-{count}", function, district.style)


def function_of(kind: BuildingType) -> str:
    """Return what a kind is used for, by its name."""
    invented, _, _ = kind.name.partition("-")
    return FUNCTION_OF.get(kind.name, invented)


def _invent(rng: np.random.Generator, name: str, function: str, style: Style) -> BuildingType:
    least_m, most_m = _SIZES_M[function]
    width_m, depth_m, height_m = rng.uniform(least_m, most_m).round(1).tolist()
    pattern = style.patterns[int(rng.integers(2))]
    is_gabled = rng.random() < style.gabled

    return BuildingType(
        name=name,
        width_m=width_m,
        depth_m=depth_m,
        height_m=height_m,
        wall=_paint(rng, style.wall_hue, (0.6, 0.95)),
        accent=_paint(rng, style.accent_hue, (0.25, 0.55)),
        trim=style.trim,
        door=_paint(rng, float(rng.random()), (0.3, 0.6)),
        roof=style.roof,
        pattern=pattern,
        roof_rise_m=GABLE_M if is_gabled else FLAT_M,
    )


def _paint(rng: np.random.Generator, hue: float, value: tuple[float, float]) -> Colour:
    """Draw a colour near a hue."""
    deviation = float(rng.normal(0.0, 0.03))
    saturation = float(rng.uniform(0.35, 0.8))
    brightness = float(rng.uniform(*value))

    near_hue = (hue + deviation) % 1.0
    shares = colorsys.hsv_to_rgb(near_hue, saturation, brightness)

    red, green, blue = (round(255 * share) for share in shares)
    return red, green, blue
