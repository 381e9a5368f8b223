"""Of which individual object a percept is, where several look alike."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cogmap.schemas.array import Array
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import NEVER_NS, Misfits, Object, object_id, percept_id
from cogmap.schemas.nodes import Percept as PerceptNode
from cogmap.schemas.sensing import Percept
from cogmap.services.workspace.individuals import individuals
from cogmap.testing import agent, graph_of, landmark, percept, percepts, stamp_ns
from tests.support.world.scenes import Desk

STILL = Array.of(np.zeros((0, 5)))
NORTH_RAD = math.pi / 2
SEEN_NS = stamp_ns(0)


def _house(label: str, x_m: float, y_m: float, **facts: float) -> Object:
    return landmark(label, [(x_m, y_m)], **({"sightings": 9} | facts))


def _labels(
    objects: Sequence[Object],
    *seen: Percept,
    motions: Array = STILL,
    not_elsewhere_ns: int = NEVER_NS,
) -> list[str]:
    """The labels of what an agent at the origin sees, who knows `objects`."""
    looker = agent(misfits=Misfits(not_elsewhere_ns=not_elsewhere_ns))
    entered = individuals(percepts(0, *seen), graph_of(looker, *objects), motions)
    return [each.label for each in entered.objects]


def test_a_percept_near_the_object_of_its_name_is_of_that() -> None:
    assert _labels([_house("inn", 20.0, 0.0)], percept("inn", 0.0, 22.0)) == ["inn"]


def test_a_percept_of_nothing_known_keeps_its_name() -> None:
    assert _labels([], percept("inn")) == ["inn"]


def test_where_another_landmark_confirms_the_pose_a_distant_percept_is_of_another_object() -> None:
    known = [_house("inn", 20.0, 0.0), _house("mill", 30.0, 0.0)]
    seen = (percept("inn", NORTH_RAD, 20.0), percept("mill", 0.0, 30.0))

    assert _labels(known, *seen) == ["inn~2", "mill"]


def test_a_percept_is_of_the_nearest_of_those_that_look_alike() -> None:
    known = [_house("inn", 20.0, 0.0), _house("inn~2", 0.0, 20.0), _house("inn~4", 0.0, 40.0)]

    assert _labels(known, percept("inn", NORTH_RAD, 19.0)) == ["inn~2"]
    assert _labels(known, percept("inn", NORTH_RAD, 41.0)) == ["inn~4"]


def test_a_label_that_was_forgotten_is_used_again() -> None:
    known = [_house("inn", 20.0, 0.0), _house("inn~3", 0.0, 20.0), _house("mill", 30.0, 0.0)]
    seen = (percept("inn", -NORTH_RAD, 20.0), percept("mill", 0.0, 30.0))

    assert _labels(known, *seen) == ["inn~2", "mill"]


def test_where_nothing_fits_the_agent_may_be_elsewhere_and_percepts_keep_their_names() -> None:
    known = [_house("inn", 20.0, 0.0), _house("mill", 30.0, 0.0)]
    seen = (percept("inn", NORTH_RAD, 20.0), percept("mill", NORTH_RAD, 30.0))

    assert _labels(known, *seen) == ["inn", "mill"]


def test_an_object_that_is_new_since_nothing_fits_confirms_nothing() -> None:
    known = [_house("inn", 20.0, 0.0), _house("mill", 30.0, 0.0, created_ns=1)]
    seen = (percept("inn", NORTH_RAD, 20.0), percept("mill", 0.0, 30.0))

    assert _labels(known, *seen) == ["inn", "mill"]


def test_an_agent_that_can_be_nowhere_else_sees_other_objects_for_a_while() -> None:
    known = [_house("inn", 20.0, 0.0)]
    seen = percept("inn", NORTH_RAD, 20.0)
    long_ago_ns = SEEN_NS - 60_000_000_000

    assert _labels(known, seen, not_elsewhere_ns=SEEN_NS) == ["inn~2"]
    assert _labels(known, seen, not_elsewhere_ns=long_ago_ns) == ["inn"]


def _seen_of_late(label: str) -> PerceptNode:
    return PerceptNode(id=percept_id(label), label=label, bearing_rad=0.0, range_m=20.0)


def _labels_where(
    *seen: Percept, sightings: int = 9, percepts_of: Sequence[str] = ("mill", "barn")
) -> list[str]:
    """The labels of what an agent sees who stands between a mill in the east and a barn in the
    north, both of which it has seen just now.
    """
    known = [_house("mill", 30.0, 0.0), _house("barn", 0.0, 20.0, sightings=sightings)]
    graph = graph_of(agent(), *known, *map(_seen_of_late, percepts_of))

    entered = individuals(percepts(0, *seen), graph, STILL)
    return [each.label for each in entered.objects]


def test_a_percept_in_the_place_of_another_object_is_of_that() -> None:
    seen = (percept("inn", NORTH_RAD, 20.5), percept("mill", 0.0, 30.0))

    assert _labels_where(*seen) == ["barn", "mill"]
    assert _labels_where(*seen, sightings=1) == ["inn", "mill"]
    assert _labels_where(*seen, percepts_of=["mill"]) == ["inn", "mill"]


def test_a_percept_that_is_seen_vaguely_is_of_the_object_that_it_may_be_where_it_is() -> None:
    known = percept("mill", 0.0, 30.0)
    vague = percept("inn", NORTH_RAD, 24.0, range_sd_m=2.5)
    sure = percept("inn", NORTH_RAD, 24.0)
    far = percept("inn", NORTH_RAD, 27.0, range_sd_m=5.0)

    assert _labels_where(vague, known) == ["barn", "mill"]
    assert _labels_where(sure, known) == ["inn", "mill"]
    assert _labels_where(far, known) == ["inn", "mill"]


def test_an_object_that_was_hardly_seen_yields_to_the_one_in_its_place() -> None:
    seen = (percept("inn", NORTH_RAD, 20.5), percept("mill", 0.0, 30.0))
    known = [_house("mill", 30.0, 0.0), _house("barn", 0.0, 20.0)]
    of_late = [_seen_of_late(label) for label in ("mill", "barn")]

    for sightings, label in ((1, "barn"), (9, "inn")):
        same_place = _house("inn", 0.0, 20.5, sightings=sightings)
        graph = graph_of(agent(), *known, same_place, *of_late)
        entered = individuals(percepts(0, *seen), graph, STILL)
        assert [each.label for each in entered.objects] == [label, "mill"]


def test_two_percepts_in_one_view_are_of_two_objects() -> None:
    seen = (percept("inn", NORTH_RAD, 21.0), percept("barn", NORTH_RAD, 20.0))

    assert _labels_where(*seen) == ["inn", "barn"]


def test_a_surveyed_landmark_is_the_only_one_of_its_name() -> None:
    known = [_house("inn", 20.0, 0.0, surveyed=True), _house("mill", 30.0, 0.0)]
    seen = (percept("inn", NORTH_RAD, 20.0), percept("mill", 0.0, 30.0))

    assert _labels(known, *seen) == ["inn", "mill"]


def test_a_percept_without_a_bearing_keeps_its_name() -> None:
    known = [_house("inn", 20.0, 0.0), _house("mill", 30.0, 0.0)]
    seen = (percept("inn", 0.0, 90.0, bearing_sd_rad=math.tau), percept("mill", 0.0, 30.0))

    assert _labels(known, *seen) == ["inn", "mill"]


def test_percepts_are_seen_from_where_the_agent_has_moved_to() -> None:
    moved = Array.of(np.array([[20.0, 0.0, 1.0, 0.1, 0.0]]))
    known = [_house("inn", 20.0, 0.0), _house("inn~2", 40.0, 0.0)]

    assert _labels(known, percept("inn", 0.0, 20.0), motions=moved) == ["inn~2"]


def test_an_object_of_the_same_look_gets_a_node_of_its_own() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("inn", 0.0, 20.0), percept("mill", -0.3, 30.0))
    desk.drive(range(3, 6), percept("inn", 1.0, 20.0), percept("mill", -0.3, 30.0))

    assert {object_id("inn"), object_id("inn~2")} <= set(desk.graph.nodes)


def test_an_interrupted_cycle_continues_with_the_labels_it_began_with() -> None:
    whole = Desk("w1")
    whole.drive(range(3), percept("inn", 0.0, 20.0), percept("mill", -0.3, 30.0))
    whole.drive(range(3, 4), percept("inn", 1.0, 20.0), percept("mill", -0.3, 30.0))
    cut = next(
        number
        for number, delta in enumerate(whole.deltas)
        if delta.cycle == whole.graph.cycle and delta.phase is Phase.LOCALIZATION
    )

    again = Desk("w1")
    assert again.module.restore is not None
    again.module.restore(whole.deltas[: cut + 1])
    again.drive(range(3, 4), percept("inn", 1.0, 20.0), percept("mill", -0.3, 30.0))

    assert again.digest == whole.digest
