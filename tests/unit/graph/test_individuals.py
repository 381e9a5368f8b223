"""Two objects that are one individual: they look alike, and stand where only one of them can."""

from __future__ import annotations

from cogmap.graph.individuals import is_among, is_same, reach_m, shares
from cogmap.schemas.nodes import Object
from cogmap.testing import landmark


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
