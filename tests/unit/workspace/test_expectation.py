"""What was recognised with the help of what was expected is active, and maps nothing."""

from __future__ import annotations

from cogmap.schemas.nodes import Object, object_id
from cogmap.testing import percept
from tests.support.world.scenes import Desk


def _desk() -> Desk:
    """A workspace that has mapped two houses and has not seen one of them for a while."""
    desk = Desk("w1")
    desk.drive(range(8), percept("house"), percept("shop", 0.4))
    desk.drive(range(8, 14), percept("house"))
    return desk


def test_an_expected_object_becomes_active_and_is_not_placed_anew() -> None:
    desk = _desk()
    before = desk.graph.get(Object, object_id("shop"))
    assert before is not None

    desk.drive(range(14, 15), percept("shop", -1.2, activation=0.9, evidence=0.3))
    after = desk.graph.get(Object, object_id("shop"))
    assert after is not None
    assert desk.graph.activation(after) > 0.85
    assert (after.x_m, after.y_m, after.sightings) == (before.x_m, before.y_m, before.sightings)


def test_what_is_expected_and_unknown_gets_no_object() -> None:
    desk = _desk()
    desk.drive(range(14, 20), percept("bakery", activation=0.9, evidence=0.3))

    assert desk.graph.get(Object, object_id("bakery")) is None


def test_what_was_expected_but_is_sure_by_itself_is_mapped() -> None:
    desk = _desk()
    desk.drive(range(14, 20), percept("bakery", 0.2, activation=0.9, evidence=0.8))

    assert desk.graph.get(Object, object_id("bakery")) is not None
