"""How alike what is seen and what is known look: by appearance, by name, and by size."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.graph.likeness import (
    MAX_APPEARANCES,
    distribution,
    is_new_side,
    likeness,
    look_ratio,
    name_ratio,
    size_ratio,
)
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.sensing import Appearance
from cogmap.testing import landmark, percept


def _seen(angle_rad: float) -> Appearance:
    direction = np.array([math.cos(angle_rad), math.sin(angle_rad)], np.float32)
    return Appearance(direction=Array.of(direction), sharpness=10.0, even_cosine=0.5)


def _known(*angles_rad: float) -> Matrix:
    return Matrix.of(np.array([[math.cos(each), math.sin(each)] for each in angles_rad]), "<f2")


def test_a_name_that_most_views_gave_is_far_likelier_of_that_object() -> None:
    assert name_ratio({"inn": 0.9}, {"inn": 9.0}) > 10.0
    assert name_ratio({"inn": 0.9}, {"mill": 9.0}) < 0.3


def test_the_more_views_gave_a_name_the_more_it_says() -> None:
    once = name_ratio({"inn": 0.9}, {"inn": 1.0})
    often = name_ratio({"inn": 0.9}, {"inn": 20.0})

    assert 1.0 < once < often


def test_a_name_says_nothing_where_either_has_none() -> None:
    assert name_ratio({}, {"inn": 9.0}) == 1.0
    assert name_ratio({"inn": 0.9}, {}) == 1.0


def test_names_of_a_view_are_together_as_likely_as_any() -> None:
    """Over all names that an object may have, the ratios of a sure view add up to their number."""
    sure = [name_ratio({name: 1.0}, {"a": 3.0, "b": 1.0}) for name in "ab"]

    assert sure[0] > sure[1] > 1.0
    assert name_ratio({"c": 1.0}, {"a": 3.0, "b": 1.0}) == pytest.approx(1 / 5)


def test_the_distribution_of_a_percept_has_its_name_with_its_evidence_beside_the_others() -> None:
    seen = percept("inn", activation=0.95, evidence=0.6, names={"mill": 0.3})

    assert distribution(seen) == {"mill": 0.3, "inn": 0.6}


def test_of_several_sides_the_one_most_alike_counts() -> None:
    known = _known(0.0, math.pi / 2)
    ratios = [look_ratio(_seen(angle_rad), known) for angle_rad in (0.0, math.pi / 2, math.pi)]

    one, other, unlike = (ratio for ratio in ratios if ratio is not None)
    assert one == pytest.approx(other, rel=1e-2)
    assert one > 10.0
    assert unlike < 1.0


def test_a_side_that_was_never_seen_does_not_rule_an_object_out() -> None:
    ratio = look_ratio(_seen(math.pi), _known(0.0))

    assert ratio is not None
    assert ratio > 0.1


def test_appearances_that_cannot_be_compared_say_nothing() -> None:
    of_other_length = Matrix.of(np.eye(3), "<f2")

    assert look_ratio(None, _known(0.0)) is None
    assert look_ratio(_seen(0.0), None) is None
    assert look_ratio(_seen(0.0), of_other_length) is None


def test_an_object_whose_appearance_is_known_is_compared_by_that_and_not_by_name() -> None:
    node = landmark("41a", names={"inn": 9.0}, appearances=_known(0.0))
    seen = percept("mill", appearance=_seen(0.0))

    assert likeness(seen, node) > 10.0


def test_a_cut_percept_is_not_compared_by_size() -> None:
    node = landmark("41a", names={"inn": 9.0}, width_m=20.0)
    cut = percept("inn", width_m=5.0, whole=False)
    whole = percept("inn", width_m=5.0)

    assert likeness(cut, node) > 2 * likeness(whole, node)


def test_two_widths_are_the_more_alike_the_nearer_their_ratio_is_to_one() -> None:
    ratios = [size_ratio(8.0, known_m) for known_m in (8.0, 10.0, 14.0, 40.0)]

    assert ratios == sorted(ratios, reverse=True)
    assert ratios[0] > 1.0 > ratios[-1] > 0.0
    assert size_ratio(8.0, 14.0) == pytest.approx(size_ratio(14.0, 8.0))


def test_an_unknown_width_says_nothing() -> None:
    assert size_ratio(0.0, 8.0) == 1.0
    assert size_ratio(8.0, 0.0) == 1.0


def test_a_side_is_new_if_it_is_unlike_all_that_are_known_and_there_is_room() -> None:
    full = _known(*[0.7 * number for number in range(MAX_APPEARANCES)])

    assert is_new_side(_seen(1.0), None)
    assert is_new_side(_seen(1.0), _known(0.0))
    assert not is_new_side(_seen(0.1), _known(0.0))
    assert not is_new_side(_seen(-0.7), full)
