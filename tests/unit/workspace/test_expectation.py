"""What was expected makes a percept active; what it is called is learned from views alone."""

from __future__ import annotations

import pytest

from cogmap.schemas.nodes import Object
from cogmap.schemas.sensing import Percept
from cogmap.testing import percept, unidentified
from tests.support.world.scenes import Desk

RESTS = ((0.0, 0.0, 0.2, 0.01, 0.001),)


def _seen(*views: Percept) -> Object:
    """The one object that is known after these views of it from one place."""
    desk = Desk("w1")
    for frame, view in enumerate(views):
        desk.see(frame, unidentified(view), rows=RESTS)
        desk.work()
    (node,) = desk.graph.of_kind(Object)
    return node


def test_what_was_expected_is_active_and_adds_no_evidence_for_its_name() -> None:
    node = _seen(*[percept("shop", activation=0.9, evidence=0.3)] * 4)

    assert node.activation == pytest.approx(0.9)
    assert node.names["shop"] == pytest.approx(4 * 0.3)
    assert node.names[""] == pytest.approx(4 * 0.7)


def test_an_object_is_called_what_most_views_would_call_it() -> None:
    node = _seen(percept("shop", evidence=0.6), *[percept("bakery", evidence=0.8)] * 3)

    assert node.look == "bakery"
    assert node.names["shop"] == pytest.approx(0.6)


def test_one_that_views_have_no_name_for_is_an_object_without_a_name() -> None:
    node = _seen(*[percept("shop", name="", evidence=0.0)] * 3)

    assert (node.look, node.name) == ("", "")


def test_other_names_that_a_view_makes_likely_count_as_well() -> None:
    node = _seen(*[percept("shop", evidence=0.5, names={"bakery": 0.4})] * 3)

    assert node.names == pytest.approx({"shop": 1.5, "bakery": 1.2, "": 0.3})
