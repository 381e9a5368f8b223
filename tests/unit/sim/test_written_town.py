"""Towns that people write as TOML."""

from __future__ import annotations

import math
from pathlib import Path
from typing import get_args

import pytest

from cogmap.errors import ConfigError
from cogmap.services.sim.layout import towns
from cogmap.services.sim.layout.written.tables import Pattern
from cogmap.services.sim.layout.written.town import WrittenTown, read
from cogmap.services.sim.rendering.patterns import PAINT
from cogmap.testing import Town

EXAMPLE = Path(__file__).parents[3] / "examples" / "towns" / "mytown.toml"
SMALL = """
[start]
at_m = [10, 0]
heading_deg = 90

[[street]]
name = "Elm Street"
line_m = [[0, 0], [60, 0], [60, 40]]

[[street]]
name = "Oak Street"
line_m = [[0, 0], [0, 40]]

[[building]]
kind = "bakery"
at_m = [30, 12]

[[building]]
name = "windmill"
at_m = [30, -14]
size_m = [10, 9, 12]
wall = "#102030"

[[charging_place]]
at_m = [20, 5]

[[goal]]
building = "windmill"

[[goal]]
at_m = [10, 20]
"""


def _read(folder: Path, text: str = SMALL) -> WrittenTown:
    path = folder / "small.toml"
    path.write_text(text)
    return read(path)


def test_a_street_that_bends_is_straight_from_corner_to_corner(tmp_path: Path) -> None:
    roads = _read(tmp_path).roads

    assert [road.name for road in roads] == ["Elm Street", "Elm Street", "Oak Street"]
    assert roads[1].end == (60.0, 40.0)


def test_a_building_is_of_a_kind_or_looks_as_it_is_written(tmp_path: Path) -> None:
    bakery, windmill = _read(tmp_path).plots

    assert (bakery.kind.name, bakery.kind.width_m, bakery.function) == ("bakery", 9.0, "shop")
    assert (windmill.kind.height_m, windmill.kind.wall) == (12.0, (16, 32, 48))
    assert _read(tmp_path).plots[1].kind == windmill.kind


def test_a_front_looks_to_the_nearest_street_or_where_it_is_told_to(tmp_path: Path) -> None:
    turned = SMALL.replace("at_m = [30, -14]", "at_m = [30, -14]\nfront_deg = 0")
    bakery, windmill = _read(tmp_path, turned).plots

    # A front looks to the right of its heading.
    assert bakery.heading_rad == pytest.approx(0.0)
    assert windmill.heading_rad == pytest.approx(math.pi / 2)


def test_goals_are_given_in_the_frame_of_the_start(tmp_path: Path) -> None:
    by_name, by_place = _read(tmp_path).goals

    assert (by_name.building, by_name.name) == ("windmill", "windmill")
    assert (by_place.x_m, by_place.y_m) == pytest.approx((20.0, 0.0))


def test_its_charging_places_are_there_if_the_robot_needs_energy(tmp_path: Path) -> None:
    _read(tmp_path)
    path = str(tmp_path / "small.toml")

    assert not towns.place(path, 1, 200.0).charging_places
    assert towns.place(path, 1, 200.0, charging_places=4).charging_places_m == [(20.0, 5.0)]


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ("at_m = [10, 0]", "at_m = [10, 20]", r":3: the start is on no street.*\[30, 0\] is on"),
        ('"Oak Street"', '"Elm Street"', r":7: two streets are named 'Elm Street'"),
        ("[[0, 0], [0, 40]]", "[[90, 9], [99, 9]]", r":12: no street leads from 'Elm Street' to"),
        ("[60, 0], [60, 40]", "[60, 0], [60, 0]", r":8: 'Elm Street' has a corner twice"),
        ('"bakery"', '"bakrey"', r":15: there is no kind 'bakrey': did you mean 'bakery'\?"),
        ('kind = "bakery"', 'name = "bakery"', r":15: 'bakery' is a kind .* write it as kind"),
        ('kind = "bakery"', "", r"a kind that perception was taught, or a name: give one"),
        ("[30, 12]", "[30, 12]\nwall = '#ffffff'", r":17: a bakery has the wall of its kind"),
        ("at_m = [30, 12]", "at_m = [30, 6]", r":16: the bakery stands on 'Elm Street': move it"),
        ("[30, -14]", "[30, 14]", r":20: the bakery overlaps the windmill: move one"),
        ("[20, 5]", "[20, 0]", r":25: a charging place stands on 'Elm Street'"),
        ("[20, 5]", "[20, 25]", r":25: a charging place is far from every street"),
        (
            '= "windmill"\n\n[[goal]]',
            '= "mill"\n\n[[goal]]',
            r":28: the town has no building 'mill'",
        ),
        ("at_m = [10, 20]", "at_m = [30, 12]", r":31: a goal lies in the bakery"),
        ("[[street]]", "[[steet]]", r"unknown field `steet`.*did you mean 'street'\?"),
        ("#102030", "blue", r":22: Expected `str` matching regex"),
    ],
)
def test_what_is_wrong_is_named_with_its_line_and_the_remedy(
    before: str, after: str, complaint: str, tmp_path: Path
) -> None:
    assert before in SMALL
    with pytest.raises(ConfigError, match=rf"small\.toml.*{complaint}"):
        _read(tmp_path, SMALL.replace(before, after, 1))


def test_patterns_that_are_painted_may_be_written() -> None:
    # Gates need a wide front.
    assert {*get_args(Pattern)} >= {*PAINT} - {"gates"}


def test_an_agent_drives_through_the_example() -> None:
    with Town(settings={"sim": {"town": str(EXAMPLE)}}) as town:
        town.run(seconds=6.0)
        travelled_m = town.true_poses[-1].travelled_m

        assert travelled_m > 5.0
        assert town.true_poses[-1].collisions == 0
