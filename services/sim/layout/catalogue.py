"""The kinds of building in a town: each has its own size, colours and façade, the same in every
town. Pure.
"""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import numpy as np

Colour = tuple[int, int, int]

FLAT_M = 0.0
GABLE_M = 2.2
"""How much higher than its eaves the ridge of a roof is."""


@dataclass(frozen=True)
class BuildingType:
    """Size in metres, colours as RGB bytes, `pattern` as `patterns` draws it.

    `accent` is the second strong colour: of shutters, bands or stripes. `roof_rise_m` is how much
    higher the roof's ridge, along the width, is than its eaves; 0 of a flat roof.
    """

    name: str
    width_m: float
    depth_m: float
    height_m: float
    wall: Colour
    accent: Colour
    trim: Colour
    door: Colour
    roof: Colour
    pattern: str
    roof_rise_m: float = FLAT_M


def _rgb(hexadecimal: str) -> Colour:
    red, green, blue = bytes.fromhex(hexadecimal)
    return red, green, blue


def _type(
    name: str,
    size_m: tuple[float, float, float],
    colours: str,
    finish: tuple[str, str],
    pattern: str,
    *,
    roof_rise_m: float = FLAT_M,
) -> BuildingType:
    """Make a type; `size_m`: width, depth, height; `colours`: of wall, accent and door; `finish`:
    colours of trim and roof.
    """
    width_m, depth_m, height_m = size_m
    wall, accent, door = colours.split()
    trim, roof = finish

    return BuildingType(
        name=name,
        width_m=width_m,
        depth_m=depth_m,
        height_m=height_m,
        wall=_rgb(wall),
        accent=_rgb(accent),
        trim=_rgb(trim),
        door=_rgb(door),
        roof=_rgb(roof),
        pattern=pattern,
        roof_rise_m=roof_rise_m,
    )


_WHITE = "f0eee8"
_CREAM = "ecdeba"
_STONE = "c4bcac"
_DARK = "343032"
_TILE = "9e4832"
_SLATE = "4a5262"
_COPPER = "60a88e"
_THATCH = "aa8e56"

CATALOGUE: tuple[BuildingType, ...] = (
    _type(
        "bakery",
        (9.0, 8.0, 6.5),
        "f0b048 84341c 602c18",
        (_CREAM, _TILE),
        "shutters",
        roof_rise_m=GABLE_M,
    ),
    _type("library", (13.5, 10.0, 9.0), "962c28 eee2c4 40281c", (_CREAM, _SLATE), "bands"),
    _type(
        "town_hall",
        (14.0, 9.5, 13.0),
        "e8ce60 244696 243c80",
        (_WHITE, _SLATE),
        "bands",
        roof_rise_m=GABLE_M,
    ),
    _type("pharmacy", (8.0, 7.0, 7.0), "eef0ec 16a04c 146e3c", ("16a04c", _SLATE), "cross"),
    _type("post_office", (10.0, 8.0, 7.5), "f8d21e 222226 222226", (_DARK, _DARK), "bands"),
    _type("cinema", (13.0, 11.0, 10.5), "62227a f6c82e be1e3c", ("f6c82e", _DARK), "stripes"),
    _type("school", (14.0, 9.0, 8.0), "e0743e faf4e2 1c5c78", (_WHITE, _SLATE), "grid"),
    _type("bank", (11.0, 9.0, 10.0), "7a8878 1a4a34 183c2c", (_STONE, _COPPER), "columns"),
    _type("hotel", (12.0, 9.0, 14.0), "ec94a4 84143e 781438", (_WHITE, _SLATE), "shutters"),
    _type("fire_station", (12.0, 10.0, 8.0), "ce1c1e f6f6f0 faf8f0", (_WHITE, _DARK), "gates"),
    _type("police_station", (11.0, 8.5, 8.5), "24429e ecf0f8 162254", (_WHITE, _SLATE), "bands"),
    _type(
        "florist",
        (7.0, 6.0, 5.0),
        "f6a8ce 2e8a34 2e8a34",
        ("2e8a34", _THATCH),
        "stripes",
        roof_rise_m=GABLE_M,
    ),
    _type("cafe", (7.5, 7.0, 6.0), "46b2b2 faeccc 7e4224", (_CREAM, _TILE), "stripes"),
    _type(
        "museum",
        (14.0, 12.0, 9.5),
        "b0dcbe 5c3e8c 46326e",
        (_STONE, _COPPER),
        "columns",
        roof_rise_m=GABLE_M,
    ),
    _type("theatre", (12.5, 11.0, 12.0), "78163a deac62 3c0e1e", ("deac62", _COPPER), "columns"),
    _type("workshop", (10.5, 9.5, 5.5), "60666e f48414 f48414", ("f48414", _SLATE), "gates"),
    _type(
        "brewery",
        (11.0, 10.0, 11.0),
        "7c4a22 cede3c 345226",
        (_CREAM, _TILE),
        "grid",
        roof_rise_m=GABLE_M,
    ),
    _type("greengrocer", (8.5, 7.0, 6.0), "80c43a f6f6e8 386822", (_WHITE, _TILE), "stripes"),
    _type(
        "bookshop",
        (6.5, 7.0, 8.5),
        "1e5442 e25a48 962822",
        (_CREAM, _TILE),
        "shutters",
        roof_rise_m=GABLE_M,
    ),
    _type("clinic", (13.0, 8.0, 7.0), "c4e2f6 ce1e2c 4678a0", (_WHITE, _SLATE), "cross"),
    _type(
        "boathouse",
        (9.5, 8.0, 5.5),
        "2892e0 faf0dc f8c43c",
        (_WHITE, _THATCH),
        "planks",
        roof_rise_m=GABLE_M,
    ),
    _type(
        "toy_shop",
        (7.0, 6.5, 7.0),
        "fae23c de2882 de2882",
        ("286ed2", _TILE),
        "checker",
        roof_rise_m=GABLE_M,
    ),
    _type("tailor", (6.0, 6.5, 9.5), "a484d6 3c2060 3c2060", (_WHITE, _SLATE), "shutters"),
    _type(
        "farmhouse",
        (10.0, 7.5, 6.5),
        "eee8d6 5c3820 462c1a",
        ("5c3820", _THATCH),
        "timber",
        roof_rise_m=GABLE_M,
    ),
)

_PATTERNS = (
    "",
    "bands",
    "stripes",
    "columns",
    "checker",
    "planks",
    "timber",
    "cross",
    "gates",
    "grid",
    "shutters",
)
_FINISHES = (_WHITE, _CREAM, _STONE, _DARK)
# Of 255 levels of red, green or blue: a pattern is to be seen on its wall.
MIN_CONTRAST = 80
_ROOFS = (_TILE, _SLATE, _COPPER, _THATCH, _DARK)


def invented(seed: int, count: int) -> tuple[BuildingType, ...]:
    """Invent `count` kinds that are in no catalogue, named after `seed`: buildings that no network
    was trained on.
    """
    rng = np.random.default_rng([seed, 0x1D])

    kinds = []
    for number in range(count):
        kinds.append(_invent(f"invented-{seed}-{number}", rng))

    return tuple(kinds)


def _invent(name: str, rng: np.random.Generator) -> BuildingType:
    pattern = str(rng.choice(_PATTERNS))
    height_m = float(rng.uniform(5, 14))
    least_width_m = 9 if pattern == "gates" else 6
    width_m = float(rng.uniform(least_width_m, 14))
    depth_m = float(rng.uniform(6, 12))

    wall = _paint(rng)
    accent = _paint(rng)
    while max(abs(x - y) for x, y in zip(wall, accent, strict=True)) < MIN_CONTRAST:
        accent = _paint(rng)

    trim = _rgb(str(rng.choice(_FINISHES)))
    roof = _rgb(str(rng.choice(_ROOFS)))
    is_gabled = rng.random() < 0.35

    return BuildingType(
        name=name,
        width_m=width_m,
        depth_m=depth_m,
        height_m=height_m,
        wall=wall,
        accent=accent,
        trim=trim,
        door=_paint(rng),
        roof=roof,
        pattern=pattern,
        roof_rise_m=GABLE_M if is_gabled else FLAT_M,
    )


def _paint(rng: np.random.Generator) -> Colour:
    """Draw a colour that a house may have: of any hue, from white over strong to dark."""
    pale = rng.uniform(0.0, 0.2)
    strong = rng.uniform(0.3, 0.95)
    saturation = float(rng.choice([pale, strong], p=[0.25, 0.75]))

    hue = float(rng.random())
    value = float(rng.uniform(0.35, 0.98))

    shares = colorsys.hsv_to_rgb(hue, saturation, value)

    levels = [round(255 * share) for share in shares]
    return levels[0], levels[1], levels[2]
