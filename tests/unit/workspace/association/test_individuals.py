"""Of which individual object each percept of a view is: by place, look and size together."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import Misfits, Object, Self
from cogmap.schemas.sensing import Appearance, Percept
from cogmap.services.workspace.association.individuals import Individuals
from cogmap.testing import (
    agent,
    graph_of,
    landmark,
    of_type,
    percept,
    percept_at,
    percepts,
    stamp_ns,
    unidentified,
)
from tests.support.world.scenes import Desk

STILL = Array.of(np.zeros((0, 5)))
NORTH_RAD = math.pi / 2
NEW = "2a"
"""The label of the first object that is new in cycle 2, in which a graph of cycle 1 is seen."""

WAITS = ""
UNSURE_FRAME = 3000
"""A view so long after anything fitted the map that the agent may well be elsewhere."""


def _house(label: str, x_m: float, y_m: float, *, name: str = "inn", **facts: object) -> Object:
    """A house that was seen nine times and that most views call so."""
    names = {name: 9.0} if name else {}
    usual = {"names": names, "sightings": 9, "width_m": 8.0, "x_sd_m": 0.3, "y_sd_m": 0.3}
    return landmark(label, [(x_m, y_m)], **(usual | facts))


def _sight(name: str, x_m: float, y_m: float, **facts: object) -> Percept:
    """A percept, seen from the origin, of something at (x, y) that perception has a name for."""
    sight = percept(name or "nameless", math.atan2(y_m, x_m), math.hypot(x_m, y_m), **facts)
    nameless = {} if name else {"name": "", "evidence": 0.0}
    return unidentified(sight, **nameless)


def _appearance(angle_rad: float) -> Appearance:
    """What something looks like from one side; sides a right angle apart have nothing in common."""
    direction = np.array([math.cos(angle_rad), math.sin(angle_rad)], np.float32)
    return Appearance(direction=Array.of(direction), sharpness=10.0, even_cosine=0.5)


def _entered(
    known: Sequence[Object],
    *seen: Percept,
    looker: Self | None = None,
    motions: Array = STILL,
    frame: int = 0,
) -> list[Percept]:
    """The percepts as they enter the map of an agent that knows these objects."""
    individuals = Individuals(graph_of(looker or agent(), *known))
    individuals.known.restore()
    return individuals.labelled(percepts(frame, *seen), motions).percepts.objects


def _labels(
    known: Sequence[Object],
    *seen: Percept,
    looker: Self | None = None,
    motions: Array = STILL,
    frame: int = 0,
) -> list[str]:
    """The label of the object that each percept is found to be of; of those that wait, WAITS."""
    entered = _entered(known, *seen, looker=looker, motions=motions, frame=frame)
    label_of = {(each.bearing_rad, each.range_m): each.label for each in entered}
    return [label_of.get((each.bearing_rad, each.range_m), WAITS) for each in seen]


def test_what_is_seen_first_is_new() -> None:
    assert _labels([], _sight("inn", 20.0, 0.0), _sight("inn", 0.0, 20.0)) == ["2a", "2b"]


def test_before_the_agent_has_a_place_every_percept_is_of_a_new_object() -> None:
    individuals = Individuals(graph_of())
    entered = individuals.labelled(percepts(0, _sight("inn", 20.0, 0.0)), STILL).percepts

    assert [each.label for each in entered.objects] == [NEW]


def test_a_percept_whose_source_knows_the_individual_keeps_its_label() -> None:
    known = [_house("41a", 20.0, 0.0)]

    assert _labels(known, percept("inn", 0.0, 20.0)) == ["inn"]


def test_two_houses_that_look_alike_side_by_side_are_two() -> None:
    known = [_house("41a", 20.0, 5.0), _house("52b", 20.0, -5.0)]
    seen = (_sight("inn", 20.3, 5.2), _sight("inn", 20.1, -5.3))

    assert _labels(known, *seen) == ["41a", "52b"]
    assert _labels(known, *reversed(seen)) == ["52b", "41a"]


def test_a_percept_where_a_known_object_stands_is_of_that_whatever_its_name_in_this_view() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn"), _house("52b", 0.0, 20.0, name="mill")]

    assert _labels(known, _sight("mill", 20.2, 0.1)) == ["41a"]
    assert _labels(known, _sight("", 20.2, 0.1)) == ["41a"]


def test_what_looks_like_nothing_near_and_stands_clear_is_a_new_one() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn"), _house("52b", 0.0, 20.0, name="mill")]
    seen = (_sight("inn", 20.0, 0.0), _sight("barn", -14.0, -14.0))

    assert _labels(known, *seen) == ["41a", NEW]


def test_another_one_of_a_known_look_is_a_new_one_where_others_confirm_the_place() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn"), _house("52b", 0.0, 20.0, name="mill")]
    seen = (_sight("mill", 0.0, 20.0), _sight("inn", 20.0, 0.0), _sight("inn", -14.0, -14.0))

    assert _labels(known, *seen, frame=UNSURE_FRAME) == ["52b", "41a", NEW]


def test_the_label_of_a_new_object_states_nothing_but_its_cycle_and_number() -> None:
    seen = [_sight("inn", 20.0, 12.0 * number) for number in range(-1, 2)]

    assert _labels([], *seen) == ["2a", "2b", "2c"]


def test_where_nothing_fits_and_the_agent_may_be_elsewhere_it_is_of_what_it_looks_like() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn"), _house("52b", 30.0, 0.0, name="mill")]
    seen = (_sight("inn", 0.0, 20.0), _sight("mill", 0.0, 30.0))

    assert _labels(known, *seen, frame=UNSURE_FRAME) == ["41a", "52b"]


def test_a_lost_agent_compares_a_percept_with_its_like_however_far_off() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn"), _house("52b", 300.0, 0.0, name="mill")]
    anywhere_m = np.random.default_rng(1).normal(0.0, 150.0, (200, 2))
    lost = agent(np.column_stack([anywhere_m, np.zeros(200)]))

    assert _labels(known, _sight("mill", 20.0, 5.0), looker=lost) == ["52b"]
    assert _labels(known, _sight("mill", 20.0, 5.0)) != ["52b"]


def test_what_is_too_far_to_enter_the_map_does_not_tell_that_the_agent_is_elsewhere() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn"), _house("52b", 30.0, 0.0, name="mill")]
    far = (
        _sight("inn", 0.0, 70.0, range_sd_m=5.0),
        _sight("mill", 20.0, 70.0, range_sd_m=5.0),
    )

    assert _labels(known, *far, frame=UNSURE_FRAME) == [WAITS, WAITS]


def test_where_nothing_fits_but_the_agent_cannot_be_elsewhere_it_is_of_new_objects() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn"), _house("52b", 30.0, 0.0, name="mill")]
    seen = (_sight("inn", 0.0, 20.0), _sight("mill", 0.0, 32.0))
    now_ns = stamp_ns(UNSURE_FRAME)

    for misfits in (Misfits(last_fit_ns=now_ns), Misfits(not_elsewhere_ns=now_ns)):
        looker = agent(misfits=misfits)
        assert _labels(known, *seen, looker=looker, frame=UNSURE_FRAME) == ["2a", "2b"]


def test_a_percept_that_may_as_well_be_of_one_as_of_another_waits() -> None:
    known = [_house("41a", 20.0, 2.0), _house("52b", 20.0, -2.0)]
    seen = _sight("inn", 20.0, 0.0, range_sd_m=2.0, bearing_sd_rad=0.1)

    assert _labels(known, seen) == [WAITS]


def test_a_percept_within_an_object_that_it_does_not_look_like_is_no_new_one() -> None:
    known = [_house("41a", 20.0, 0.0, name="inn", width_m=14.0)]

    assert _labels(known, _sight("mill", 25.0, 0.0)) == [WAITS]
    assert _labels(known, _sight("mill", 28.0, 0.0)) == [NEW]


def test_two_percepts_of_a_view_are_of_two_objects_even_if_both_are_nearer_to_one() -> None:
    known = [_house("41a", 20.0, 0.0), _house("52b", 26.0, 0.0)]
    seen = (
        _sight("inn", 20.0, 0.1, range_sd_m=2.0),
        _sight("inn", 22.7, 0.0, range_sd_m=2.0),
    )

    assert _labels(known, *seen) == ["41a", "52b"]


def test_an_error_of_the_pose_that_moves_all_percepts_alike_is_no_new_object() -> None:
    known = [
        _house("41a", 20.0, 0.0, name=""),
        _house("52b", 32.0, 6.0, name=""),
        _house("63c", 15.0, -16.0, name=""),
    ]
    offset_m = 3.0
    spread = np.random.default_rng(3).normal(0.0, [2.0, 2.0, 0.0], (200, 3))
    looker = agent(spread - spread.mean(axis=0), x_sd_m=2.0, y_sd_m=2.0)
    seen = [_sight("", node.x_m + offset_m, node.y_m) for node in known]

    assert _labels(known, *seen, looker=looker) == ["41a", "52b", "63c"]


def test_landmarks_without_any_name_are_told_apart_by_place() -> None:
    known = [_house(f"{number}a", 10.0 * number, 6.0, name="") for number in range(1, 5)]
    seen = [_sight("", node.x_m + 0.2, node.y_m - 0.1) for node in known]

    assert _labels(known, *seen) == ["1a", "2a", "3a", "4a"]


def test_of_two_at_one_place_it_is_of_the_one_that_it_looks_like() -> None:
    known = [
        _house("41a", 20.0, 0.0, name="", appearances=_sides(0.0)),
        _house("52b", 20.5, 0.0, name="", appearances=_sides(NORTH_RAD)),
    ]
    for angle_rad, label in ((0.0, "41a"), (NORTH_RAD, "52b")):
        seen = _sight("", 20.2, 0.0, appearance=_appearance(angle_rad))
        assert _labels(known, seen) == [label]


def _sides(*angles_rad: float) -> Matrix:
    return Matrix.of(np.array([[math.cos(each), math.sin(each)] for each in angles_rad]), "<f2")


def test_an_appearance_is_handed_on_if_it_shows_another_side_than_those_known() -> None:
    known = [_house("41a", 20.0, 0.0, name="", appearances=_sides(0.0))]
    (same,) = _entered(known, _sight("", 20.0, 0.0, appearance=_appearance(0.1)))
    (other,) = _entered(known, _sight("", 20.0, 0.0, appearance=_appearance(1.0)))

    assert (same.label, same.appearance is None) == ("41a", True)
    assert (other.label, other.appearance is None) == ("41a", False)


def test_a_surveyed_landmark_is_the_only_one_of_its_name() -> None:
    known = [_house("inn", 20.0, 0.0, surveyed=True), _house("mill", 30.0, 0.0, name="mill")]
    seen = (_sight("inn", 0.0, 20.0), _sight("mill", 0.0, 30.0))
    (inn, _) = _labels(known, *seen, frame=UNSURE_FRAME)

    assert inn == "inn"


def test_a_percept_without_a_range_is_of_the_object_in_its_direction() -> None:
    known = [_house("41a", 20.0, 0.0), _house("52b", 0.0, 20.0)]
    seen = _sight("inn", 0.0, 9.0, range_sd_m=9.0)
    assert not seen.has_range

    assert _labels(known, seen) == ["52b"]


def test_percepts_are_seen_from_where_the_agent_has_moved_to() -> None:
    moved = Array.of(np.array([[20.0, 0.0, 1.0, 0.1, 0.0]]))
    known = [_house("41a", 20.0, 0.0), _house("52b", 40.0, 0.0)]

    assert _labels(known, _sight("inn", 20.0, 0.0)) == ["41a"]
    assert _labels(known, _sight("inn", 20.0, 0.0), motions=moved) == ["52b"]


def test_objects_of_another_map_are_not_seen() -> None:
    known = [_house("41a", 20.0, 0.0, map="map:3")]

    assert _labels(known, _sight("inn", 20.0, 0.0)) == [NEW]


def test_how_likely_a_percept_is_of_its_object_is_handed_on() -> None:
    known = [_house("41a", 20.0, 0.0)]
    (sure,) = _entered(known, _sight("inn", 20.0, 0.0))

    assert 0.9 <= sure.certainty <= 1.0


STREET = (("inn", (30.0, 8.0)), ("inn", (30.0, -8.0)), ("mill", (45.0, 8.0)))


def _drive(desk: Desk, frames: range) -> None:
    """An agent that drives straight on sees two inns and a mill."""
    for frame in frames:
        pose = (0.4 * frame, 0.0, 0.0)
        desk.see(frame, *[unidentified(percept_at(pose, name, at_m)) for name, at_m in STREET])
        desk.work()


def test_objects_of_one_look_get_nodes_of_their_own_and_keep_them() -> None:
    desk = Desk("w1")
    _drive(desk, range(6))
    objects = {node.label: node for node in desk.graph.of_kind(Object)}

    assert sorted(objects) == ["1a", "1b", "1c"]
    assert [objects[label].name for label in ("1a", "1b", "1c")] == ["inn", "inn", "mill"]
    assert [node.sightings for node in objects.values()] == [6, 6, 6]


def test_an_interrupted_cycle_continues_with_the_labels_it_began_with() -> None:
    whole = Desk("w1")
    _drive(whole, range(4))
    cut = next(
        number
        for number, delta in enumerate(whole.deltas)
        if delta.cycle == whole.graph.cycle and delta.phase is Phase.LOCALIZATION
    )

    again = Desk("w1")
    assert again.module.restore is not None
    again.module.restore(whole.deltas[: cut + 1])
    _drive(again, range(3, 4))

    assert again.digest == whole.digest


def test_a_workspace_that_begins_anew_knows_the_objects_of_its_graph() -> None:
    before = Desk("w1")
    _drive(before, range(4))

    again = Desk("w1")
    assert again.module.restore is not None
    again.module.restore(list(before.deltas))
    _drive(again, range(4, 6))

    written = {node.label for delta in again.deltas for node in of_type(Object, delta.operations)}
    assert written == {"1a", "1b", "1c"}


def test_percepts_are_published_with_all_else_that_they_had() -> None:
    seen = _sight("inn", 20.0, 0.0, function="shop")
    (entered,) = _entered([_house("41a", 20.0, 0.0)], seen)

    assert msgspec.structs.replace(entered, label="", certainty=1.0) == seen


def test_an_object_that_is_unsure_along_the_line_of_sight_may_stand_farther_but_not_aside() -> None:
    samples_m = np.random.default_rng(1).normal((30.0, 0.0), (4.0, 0.3), (200, 2))
    known = [landmark("41a", samples_m, names={}, sightings=9, width_m=8.0)]

    assert _labels(known, _sight("", 35.0, 0.0)) == ["41a"]
    assert _labels(known, _sight("", 30.0, 6.0)) != ["41a"]
