"""Sub-maps of real cities: what is read of an extract, and what is reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cogmap.cli.experiment.command import experiment
from cogmap.errors import UsageError
from cogmap.experiments.map_structure.city import UNKNOWN, read_city
from cogmap.experiments.map_structure.functions import FUNCTIONS, HOME, SHOP, WORKS, function_of
from cogmap.experiments.map_structure.measure import (
    Job,
    adjusted_rand_index,
    metrics_of,
    structured,
)

DEGREE = 1e-5
"""About a metre."""
STEP = 20
SIDE = 5


class _Extract:
    """An extract that is written node by node and way by way, in metres."""

    def __init__(self) -> None:
        self._lines = ['<osm version="0.6">']
        self._ways: list[str] = []
        self._number = 0

    def node(self, x: float, y: float, **tags: str) -> int:
        self._number += 1
        place = f'lon="{x * DEGREE:.7f}" lat="{y * DEGREE:.7f}"'
        inner = "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        self._lines.append(f'<node id="{self._number}" {place}>{inner}</node>')
        return self._number

    def way(self, *corners: tuple[float, float], closed: bool = False, **tags: str) -> None:
        nodes = [self.node(x, y) for x, y in corners]
        if closed:
            nodes.append(nodes[0])
        self._number += 1
        refs = "".join(f'<nd ref="{node}"/>' for node in nodes)
        inner = "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        self._ways.append(f'<way id="{self._number}">{refs}{inner}</way>')

    def building(self, x: float, y: float, **tags: str) -> None:
        corners = ((x - 4, y - 4), (x + 4, y - 4), (x + 4, y + 4), (x - 4, y + 4))
        self.way(*corners, closed=True, building=tags.pop("building", "yes"), **tags)

    def write(self, path: Path) -> Path:
        path.write_text("\n".join([*self._lines, *self._ways, "</osm>"]))
        return path


def _town(path: Path) -> Path:
    """Homes in the west and shops in the east of a railway, and a street."""
    extract = _Extract()
    for i in range(2 * SIDE):
        for j in range(SIDE):
            kind = "house" if i < SIDE else "retail"
            extract.building(STEP * i, STEP * j, building=kind)

    middle = STEP * (SIDE - 0.5)
    extract.way((middle, -100), (middle, 300), railway="rail")
    extract.way((-20, -20), (300, -20), highway="residential")
    extract.node(30, 30, place="suburb", name="West")
    extract.node(150, 30, place="suburb", name="East")
    return extract.write(path)


@pytest.mark.parametrize(
    ("tags", "function"),
    [
        ({"building": "apartments"}, HOME),
        ({"building": "apartments", "amenity": "pharmacy"}, SHOP),
        ({"shop": "bakery"}, SHOP),
        ({"craft": "carpenter"}, WORKS),
        ({"building": "yes"}, ""),
        ({"amenity": "bench"}, ""),
    ],
    ids=str,
)
def test_tags_imply_a_function(tags: dict[str, str], function: str) -> None:
    assert function_of(tags) == function


def test_a_building_has_the_function_of_a_place_inside(tmp_path: Path) -> None:
    extract = _Extract()
    for number in range(25):
        extract.building(20 * number, 0)
    extract.way((0, 20), (100, 20), highway="residential")
    extract.node(41, 1, shop="bakery")
    extract.node(41, 300, shop="bakery")

    city = read_city(extract.write(tmp_path / "row.osm"))

    known = np.flatnonzero(city.functions != UNKNOWN)
    assert len(city.positions_m) == 26
    assert known.tolist() == [2, 25]
    assert city.functions[2] == FUNCTIONS.index(SHOP)


def test_railways_are_boundaries_and_small_streets_are_not(tmp_path: Path) -> None:
    city = read_city(_town(tmp_path / "town.osm"))

    (rail_m,) = city.boundaries_m
    assert abs(rail_m[0, 0] - rail_m[1, 0]) < 1.0
    assert len(city.streets.pieces) == 1


def test_both_sides_of_the_railway_are_sub_maps_like_the_suburbs(tmp_path: Path) -> None:
    found = structured(Job(read_city(_town(tmp_path / "town.osm")), 1))
    metrics = metrics_of([found])

    assert metrics["town_sub_maps"] == 2.0
    assert metrics["town_objects"] == 2 * SIDE**2
    assert metrics["town_agreement_with_named_places"] == 1.0
    assert metrics["town_same_with_noise"] == 1.0
    assert metrics["town_crossed_within_share"] == 0.0
    assert metrics["town_crossed_between_share"] == 1.0


def test_an_extract_of_a_few_buildings_is_refused(tmp_path: Path) -> None:
    extract = _Extract()
    extract.building(0, 0)
    extract.way((0, 20), (100, 20), highway="residential")

    with pytest.raises(UsageError, match="1 buildings and places, at least 20 are needed"):
        read_city(extract.write(tmp_path / "hamlet.osm"))


def test_a_city_must_be_given() -> None:
    result = CliRunner().invoke(experiment, ["map-structure"])

    assert isinstance(result.exception, UsageError)
    assert "--osm FILE" in str(result.exception)


def test_equal_partitions_have_an_index_of_1_whatever_they_are_called() -> None:
    first = np.array([0, 0, 1, 1, 2])
    second = np.array([5, 5, 3, 3, 4])

    assert adjusted_rand_index(first, second) == 1.0


def test_a_partition_into_one_agrees_with_another_by_chance_alone() -> None:
    assert adjusted_rand_index(np.zeros(6, int), np.array([0, 0, 1, 1, 2, 2])) == 0.0


def test_the_index_counts_pairs_beyond_those_by_chance() -> None:
    # Of 15 pairs 6 are together in the first, 3 in the second, 2 in both; 6 * 3 / 15 by chance.
    first = np.array([0, 0, 0, 1, 1, 1])
    second = np.array([0, 0, 1, 1, 2, 2])

    assert adjusted_rand_index(first, second) == pytest.approx((2 - 1.2) / (4.5 - 1.2))
