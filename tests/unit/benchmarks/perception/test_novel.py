"""What the benchmark counts of buildings that are met once and seen again."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.perception import scenes
from benchmarks.perception.novel import Meeting, remembered
from benchmarks.perception.objects import Building, Segment, Sight
from cogmap.services.sim.layout import town
from cogmap.training.rendering import towns

TRAINED = frozenset({"bakery", "bank"})


def _meeting(
    side_rad: float, range_m: float, *claims: tuple[int, str], activation: float = 0.9
) -> Meeting:
    """A view from that side and distance of three buildings, and what each claim calls which of
    them.
    """
    segments = []
    for number, label in claims:
        building = Building(number, f"invented-{number}", 0.1, range_m)
        segments.append(Segment(label, activation, 0.1, building, building))

    sides_and_ranges = np.array([[side_rad, range_m]] * 3)
    return Meeting(Sight((), tuple(segments)), sides_and_ranges)


def test_a_building_met_once_is_recognised_from_another_side_and_distance() -> None:
    met = [
        _meeting(0.0, 10.0, (0, "new-1")),
        _meeting(0.0, 10.0, (1, "new-2")),
        _meeting(0.0, 10.0),
    ]
    later = [
        _meeting(2.0, 20.0, (0, "new-1"), (1, "new-2")),
        _meeting(2.0, 20.0, (0, "new-2"), (1, "new-9")),
        _meeting(0.5, 20.0, (0, "new-7")),
        _meeting(2.0, 11.0, (0, "new-7")),
        _meeting(2.0, 5.0, (0, "bakery"), (2, "new-8")),
    ]

    memory = remembered(met, later, TRAINED)

    assert (memory.met, memory.later, memory.right) == (2, 6, 2)
    assert (memory.merges, memory.splits, memory.mistaken) == (1, 2, 1)


def test_a_building_met_under_the_name_of_another_is_never_recognised() -> None:
    claims = ((0, "new-1"), (1, "new-1"), (2, "bakery"))
    met = [_meeting(0.0, 10.0, *claims)] * 3
    later = [_meeting(math.pi, 20.0, *claims)]

    memory = remembered(met, later, TRAINED)

    assert memory.later == 3
    assert memory.right == 1
    assert memory.merges == 2
    assert memory.mistaken == 1


def test_a_building_has_the_name_it_was_first_recognised_by_not_guessed() -> None:
    surely = _meeting(0.0, 10.0, (0, "new-1"))
    guessed = _meeting(0.0, 10.0, (0, "new-2"), activation=0.7)
    later = [_meeting(math.pi, 20.0, (0, "new-1"))]

    once_sure = remembered([guessed, surely], later, TRAINED)
    never_sure = remembered([guessed, guessed], later, TRAINED)

    assert once_sure.right == 1
    assert never_sure.met == 0


def test_a_later_view_is_from_elsewhere_and_shows_the_building() -> None:
    place = town.generate(3001, towns.kinds(3001, 30))
    rng = np.random.default_rng(1)
    for target in range(5):
        first = scenes.encounter(place, target, rng)
        again = scenes.later(place, target, first, rng)
        assert again is not None

        shown = scenes.skyline(place, first) == target
        shown_again = scenes.skyline(place, again) == target
        assert np.count_nonzero(shown) > 8
        assert shown_again.any()

        side_rad, near_m = scenes.side_and_range(place, first)[target]
        other_rad, far_m = scenes.side_and_range(place, again)[target]
        turned_rad = math.remainder(side_rad - other_rad, math.tau)
        assert abs(turned_rad) >= math.radians(45) - 1e-9
        assert max(near_m, far_m) / min(near_m, far_m) >= 1.3
        assert 5 <= far_m <= 60


def test_a_building_without_a_name_in_a_view_is_neither_met_nor_recognised() -> None:
    met = [_meeting(0.0, 10.0, (0, "")), _meeting(0.0, 10.0, (0, "new-1"))]
    later = [_meeting(2.0, 20.0, (0, "new-1"), (1, ""))]

    memory = remembered(met, later, TRAINED)

    assert (memory.met, memory.later, memory.right, memory.splits) == (1, 2, 1, 0)
