"""Where a robot begins in a town."""

from __future__ import annotations

import math

import pytest

from cogmap.services.sim.layout import towns
from cogmap.services.sim.layout.place import Place


def town(start: int = 0) -> Place:
    """One town, from one of its starts."""
    return towns.place("blocks", 5, 200.0, start=start)


def test_another_start_is_elsewhere_in_the_same_town() -> None:
    usual = town()
    other = town(start=1)

    assert (other.roads, other.plots, other.props) == (usual.roads, usual.plots, usual.props)
    away_m = math.dist((usual.start.x_m, usual.start.y_m), (other.start.x_m, other.start.y_m))
    assert away_m > 1.0


def test_a_start_is_the_same_each_time_and_each_number_has_its_own() -> None:
    starts = {(town(number).start.x_m, town(number).start.y_m) for number in range(1, 6)}

    assert town(start=2).start == town(start=2).start
    assert len(starts) > 1


@pytest.mark.parametrize("number", range(1, 6))
def test_a_robot_begins_with_room_around_it_in_the_direction_of_a_street(number: int) -> None:
    place = town(start=number)
    here_m = (place.start.x_m, place.start.y_m)

    nearest_m = min(math.dist((prop.x_m, prop.y_m), here_m) for prop in place.props)

    assert nearest_m > 8.0
    assert any(
        math.isclose(math.sin(place.start.heading_rad - road.heading_rad), 0.0, abs_tol=1e-9)
        for road in place.roads
    )
