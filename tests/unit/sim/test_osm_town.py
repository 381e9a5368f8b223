"""Towns from OpenStreetMap extracts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import ConfigError
from cogmap.services.sim.layout.boundaries import clearance_m
from cogmap.services.sim.layout.osm import town as osm
from cogmap.services.sim.layout.osm.buildings import function, height_m
from cogmap.services.sim.layout.osm.streets import metres, width_m

METRE_DEG = 1 / 111_194.93
# Metres east and north of a point on the equator, by the number of the node.
NODES = {
    1: (-60, 0),
    2: (0, 0),
    3: (60, 0),
    4: (0, 50),
    5: (10, 8),
    6: (22, 8),
    7: (22, 30),
    8: (16, 30),
    9: (16, 16),
    10: (10, 16),
    11: (-30, -20),
    12: (-10, -20),
    13: (-10, 20),
    14: (-30, 20),
    15: (300, 300),
    16: (360, 300),
}
MAIN = ("100", (1, 2, 3), {"highway": "residential", "name": "Main Street"})
SIDE = ("101", (2, 4), {"highway": "service", "width": "5.5"})
SHOP = ("200", (5, 6, 7, 8, 9, 10, 5), {"building": "retail", "name": "Corner", "height": "9 m"})
ACROSS = ("201", (11, 12, 13, 14, 11), {"building": "yes", "building:levels": "4"})
APART = ("102", (15, 16), {"highway": "residential", "name": "Far Lane"})
PATH = ("103", (1, 4), {"highway": "footway"})
Element = tuple[str, tuple[int, ...], dict[str, str]]


def _file(folder: Path, *ways: Element, scale: float = 1.0, lon: float = 0.0) -> Path:
    """Write an extract around the equator at the longitude `lon`."""
    lines = ['<osm version="0.6">']
    for number, (x_m, y_m) in NODES.items():
        east, lat = lon + scale * x_m * METRE_DEG, scale * y_m * METRE_DEG
        east = east - 360.0 if east > 180.0 else east
        lines.append(f'<node id="{number}" lon="{east:.9f}" lat="{lat:.9f}"/>')

    for way, nodes, tags in ways:
        lines.append(f'<way id="{way}">')
        lines += [f'<nd ref="{node}"/>' for node in nodes]
        lines += [f'<tag k="{key}" v="{value}"/>' for key, value in tags.items()]
        lines.append("</way>")

    path = folder / "town.osm"
    path.write_text("\n".join([*lines, "</osm>"]))
    return path


def test_streets_are_cut_at_crossings_and_named_by_number(tmp_path: Path) -> None:
    place = osm.read(_file(tmp_path, MAIN, SIDE, SHOP, PATH))
    names = sorted(road.name for road in place.roads)
    widths_m = {road.name: road.width_m for road in place.roads}

    assert names == ["Main Street 1", "Main Street 2", "service way 1"]
    assert widths_m["service way 1"] == 5.5
    assert widths_m["Main Street 1"] == 6.5


def test_a_building_has_the_outline_and_the_height_of_its_footprint(tmp_path: Path) -> None:
    place = osm.read(_file(tmp_path, MAIN, SIDE, SHOP))
    (plot,) = place.plots
    corners_m = np.array(plot.corners)
    following_m = np.roll(corners_m, -1, axis=0)
    sides_m = np.hypot(*(following_m - corners_m).T)
    x_m, y_m = corners_m.T
    next_x_m, next_y_m = following_m.T
    area_m2 = (x_m * next_y_m - y_m * next_x_m).sum() / 2

    assert plot.kind.name == "Corner"
    assert plot.function == "shop"
    assert plot.kind.height_m == 9.0
    assert sorted(sides_m) == pytest.approx([6.0, 6.0, 8.0, 12.0, 14.0, 22.0], abs=0.05)
    assert area_m2 == pytest.approx(12 * 8 + 6 * 14, abs=1.0)
    assert place.walls_m.shape == (6, 4)
    assert place.message().buildings[0].outline_m == list(plot.corners)


def test_a_street_through_a_building_and_one_apart_are_left_out(tmp_path: Path) -> None:
    place = osm.read(_file(tmp_path, MAIN, SIDE, SHOP, ACROSS, APART))
    assert sorted(road.name for road in place.roads) == ["Main Street 2", "service way 1"]


def test_a_closed_street_has_all_its_sides(tmp_path: Path) -> None:
    loop = ("104", (1, 4, 3, 2, 1), {"highway": "residential", "name": "Loop"})
    place = osm.read(_file(tmp_path, loop, SHOP))

    assert sum(road.length_m for road in place.roads) == pytest.approx(120 + 2 * 78.1, abs=0.5)


def test_a_street_that_leaves_the_extract_is_not_bridged(tmp_path: Path) -> None:
    clipped = ("105", (1, 2, 98, 99, 3, 4), {"highway": "residential", "name": "U Street"})
    place = osm.read(_file(tmp_path, SIDE, clipped, SHOP))

    assert sorted(place.roads, key=lambda road: road.name)[0].name == "U Street 1"
    assert (0.0, 60.0) not in {(road.start[0], road.end[0]) for road in place.roads}


def test_a_town_across_the_180th_meridian_is_as_large_as_elsewhere(tmp_path: Path) -> None:
    plain = osm.read(_file(tmp_path, MAIN, SIDE, SHOP))
    across = osm.read(_file(tmp_path, MAIN, SIDE, SHOP, lon=180.0))

    assert [road.length_m for road in across.roads] == [road.length_m for road in plain.roads]


def test_the_robot_starts_on_a_street_clear_of_walls(tmp_path: Path) -> None:
    place = osm.read(_file(tmp_path, MAIN, SIDE, SHOP))
    start = place.start
    to_street_m = min(
        clearance_m(np.array([[*road.start, *road.end]]), start.x_m, start.y_m)
        for road in place.roads
    )

    assert to_street_m == pytest.approx(0.0, abs=0.01)
    assert clearance_m(place.walls_m, start.x_m, start.y_m) > 1.0


def test_an_extract_without_buildings_or_streets_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"has no buildings: give an extract .* building=…"):
        osm.read(_file(tmp_path, MAIN, SIDE))

    with pytest.raises(ConfigError, match=r"has no streets: give an extract .* highway=…"):
        osm.read(_file(tmp_path, SHOP))


def test_an_extract_larger_than_4_km2_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"covers 15\.\d km².*4 km² at most: cut out a part"):
        osm.read(_file(tmp_path, MAIN, SIDE, SHOP, APART, scale=11.0))


@pytest.mark.parametrize(
    ("tags", "expected_m"),
    [
        ({"height": "12.5"}, 12.5),
        ({"height": "12,5 m"}, 12.5),
        ({"building:levels": "5"}, 15.0),
        ({"height": "tall", "building:levels": "2"}, 6.0),
        ({}, 7.0),
        ({"height": "999"}, 120.0),
        ({"height": "40'"}, 12.19),
        ({"height": "14'6\""}, 4.42),
        ({"height": "40 ft"}, 12.19),
        ({"height": "12 metres"}, 12.0),
        ({"height": "~12"}, 12.0),
        ({"building:levels": "2;3"}, 9.0),
        ({"building:levels": "5+"}, 15.0),
        ({"height": "10-12"}, 7.0),
    ],
)
def test_a_height_is_that_of_the_tag_or_of_the_levels(
    tags: dict[str, str], expected_m: float
) -> None:
    assert height_m(tags) == pytest.approx(expected_m, abs=0.005)


def test_widths_and_functions_follow_the_tags() -> None:
    assert width_m({"highway": "primary_link"}) == 10.0
    assert width_m({"highway": "service", "width": "1.5"}) == 3.0
    assert metres("narrow") is None
    assert function({"building": "yes", "shop": "bakery"}) == "shop"
    assert function({"building": "yes", "amenity": "school"}) == "school"
    assert function({"building": "yes"}) == "home"
