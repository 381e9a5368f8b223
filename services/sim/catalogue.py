"""The kinds of building a town is made of: each has its own size, colours and façade, the same in every town."""

from __future__ import annotations

from dataclasses import dataclass

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class BuildingType:
    """Size in metres, colours as RGB bytes, `pattern` and `roof_shape` as `facade` and `mesh` draw them.

    `accent` is the second strong colour: of shutters, bands or stripes.
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
    roof_shape: str = "flat"


_WHITE, _CREAM, _STONE, _DARK = (240, 238, 232), (236, 222, 186), (196, 188, 172), (52, 48, 50)
_TILE, _SLATE, _COPPER, _THATCH = (158, 72, 50), (74, 82, 98), (96, 168, 142), (170, 142, 86)

CATALOGUE: tuple[BuildingType, ...] = (
    BuildingType("bakery", 9.0, 8.0, 6.5, (240, 176, 72), (132, 52, 28), _CREAM, (96, 44, 24), _TILE, "shutters", "gable"),
    BuildingType("library", 13.5, 10.0, 9.0, (150, 44, 40), (238, 226, 196), _CREAM, (64, 40, 28), _SLATE, "bands"),
    BuildingType("town_hall", 14.0, 9.5, 13.0, (232, 206, 96), (36, 70, 150), _WHITE, (36, 60, 128), _SLATE, "bands", "gable"),
    BuildingType("pharmacy", 8.0, 7.0, 7.0, (238, 240, 236), (22, 160, 76), (22, 160, 76), (20, 110, 60), _SLATE, "cross"),
    BuildingType("post_office", 10.0, 8.0, 7.5, (248, 210, 30), (34, 34, 38), _DARK, (34, 34, 38), _DARK, "bands"),
    BuildingType("cinema", 13.0, 11.0, 10.5, (98, 34, 122), (246, 200, 46), (246, 200, 46), (190, 30, 60), _DARK, "stripes"),
    BuildingType("school", 14.0, 9.0, 8.0, (224, 116, 62), (250, 244, 226), _WHITE, (28, 92, 120), _SLATE, "grid"),
    BuildingType("bank", 11.0, 9.0, 10.0, (122, 136, 120), (26, 74, 52), _STONE, (24, 60, 44), _COPPER, "columns"),
    BuildingType("hotel", 12.0, 9.0, 14.0, (236, 148, 164), (132, 20, 62), _WHITE, (120, 20, 56), _SLATE, "shutters"),
    BuildingType("fire_station", 12.0, 10.0, 8.0, (206, 28, 30), (246, 246, 240), _WHITE, (250, 248, 240), _DARK, "gates"),
    BuildingType("police_station", 11.0, 8.5, 8.5, (36, 66, 158), (236, 240, 248), _WHITE, (22, 34, 84), _SLATE, "bands"),
    BuildingType("florist", 7.0, 6.0, 5.0, (246, 168, 206), (46, 138, 52), (46, 138, 52), (46, 138, 52), _THATCH, "stripes", "gable"),
    BuildingType("cafe", 7.5, 7.0, 6.0, (70, 178, 178), (250, 236, 204), _CREAM, (126, 66, 36), _TILE, "stripes"),
    BuildingType("museum", 14.0, 12.0, 9.5, (176, 220, 190), (92, 62, 140), _STONE, (70, 50, 110), _COPPER, "columns", "gable"),
    BuildingType("theatre", 12.5, 11.0, 12.0, (120, 22, 58), (222, 172, 98), (222, 172, 98), (60, 14, 30), _COPPER, "columns"),
    BuildingType("workshop", 10.5, 9.5, 5.5, (96, 102, 110), (244, 132, 20), (244, 132, 20), (244, 132, 20), _SLATE, "gates"),
    BuildingType("brewery", 11.0, 10.0, 11.0, (124, 74, 34), (206, 222, 60), _CREAM, (52, 82, 38), _TILE, "grid", "gable"),
    BuildingType("greengrocer", 8.5, 7.0, 6.0, (128, 196, 58), (246, 246, 232), _WHITE, (56, 104, 34), _TILE, "stripes"),
    BuildingType("bookshop", 6.5, 7.0, 8.5, (30, 84, 66), (226, 90, 72), _CREAM, (150, 40, 34), _TILE, "shutters", "gable"),
    BuildingType("clinic", 13.0, 8.0, 7.0, (196, 226, 246), (206, 30, 44), _WHITE, (70, 120, 160), _SLATE, "cross"),
    BuildingType("boathouse", 9.5, 8.0, 5.5, (40, 146, 224), (250, 240, 220), _WHITE, (248, 196, 60), _THATCH, "planks", "gable"),
    BuildingType("toy_shop", 7.0, 6.5, 7.0, (250, 226, 60), (222, 40, 130), (40, 110, 210), (222, 40, 130), _TILE, "checker", "gable"),
    BuildingType("tailor", 6.0, 6.5, 9.5, (164, 132, 214), (60, 32, 96), _WHITE, (60, 32, 96), _SLATE, "shutters"),
    BuildingType("farmhouse", 10.0, 7.5, 6.5, (238, 232, 214), (92, 56, 32), (92, 56, 32), (70, 44, 26), _THATCH, "timber", "gable"),
)

BY_NAME: dict[str, BuildingType] = {kind.name: kind for kind in CATALOGUE}
