"""Two objects that are one individual: they look alike, and stand where only one of them can."""

from __future__ import annotations

from cogmap.graph.individuals import is_among, is_same, near, reach_m, shares
from cogmap.schemas.nodes import Object
from cogmap.testing import graph_of, landmark


def _house(label: str, x_m: float, name: str = "inn", **facts: object) -> Object:
    names = {name: 9.0} if name else {}
    return landmark(label, [(x_m, 0.0)], **({"names": names, "width_m": 8.0} | facts))


def test_objects_of_one_name_whose_footprints_overlap_are_one() -> None:
    assert is_same(_house("41a", 0.0), _house("52b", 3.0))


def test_objects_of_one_name_side_by_side_are_two() -> None:
    assert not is_same(_house("41a", 0.0), _house("52b", 8.0))


def test_objects_of_other_names_are_two_wherever_they_stand() -> None:
    assert not is_same(_house("41a", 0.0), _house("52b", 0.0, "mill"))


def test_where_one_has_no_name_the_place_decides() -> None:
    assert is_same(_house("41a", 0.0), _house("52b", 3.0, ""))
    assert not is_same(_house("41a", 0.0), _house("52b", 8.0, ""))


def test_objects_of_two_maps_are_two() -> None:
    assert not is_same(_house("41a", 0.0), _house("52b", 0.0, map="map:3"))


def test_objects_reach_as_far_as_their_places_are_uncertain() -> None:
    vague = _house("52b", 8.0, x_sd_m=3.0, y_sd_m=3.0)

    assert reach_m(_house("41a", 0.0), vague) > 8.0
    assert is_same(_house("41a", 0.0), vague)


def test_the_shares_of_names_leave_out_what_has_none() -> None:
    assert shares(landmark("41a", names={"inn": 6.0, "": 2.0})) == {"inn": 0.75}
    assert shares(landmark("41a", names={})) == {}


def test_an_object_is_among_others_if_one_of_them_is_it() -> None:
    others = [_house("52b", 30.0), _house("63c", 2.0)]

    assert is_among(_house("41a", 0.0), others)
    assert not is_among(_house("41a", 60.0), others)


def test_what_stands_near_an_object_comes_with_its_distance_the_nearest_first() -> None:
    school = _house("41a", 0.0, "school")
    others = [_house("52b", 30.0), _house("53a", 12.0), _house("54a", 7.0, map="map:3")]
    found = near("school", graph_of(school, *others), 30.0)

    assert [(away_m, node.label) for away_m, node in found] == [(12.0, "53a"), (30.0, "52b")]
    assert near("school", graph_of(school, *others), 29.0) == found[:1]


def test_near_several_objects_of_a_name_is_near_one_of_them() -> None:
    inns = [_house("41a", 0.0), _house("42a", 100.0)]
    found = near("inn", graph_of(*inns, _house("53a", 90.0, "mill")), 15.0)

    assert [(away_m, node.label) for away_m, node in found] == [(10.0, "53a")]


def test_near_what_is_not_on_the_map_is_nothing() -> None:
    assert near("harbour", graph_of(_house("41a", 0.0)), 1e6) == []
