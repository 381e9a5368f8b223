"""What the attention codelets of a cycle found is published together."""

from __future__ import annotations

from cogmap.schemas.cognition import Coalitions
from cogmap.schemas.graph import Delta
from cogmap.testing import of_type, percept
from tests.support.world.scenes import Desk


def test_coalitions_are_published_once_after_the_phase_with_an_id_each() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("a"))

    first, second, third = of_type(Coalitions, desk.published)
    whereabouts, novelty = third.coalitions
    nodes = [node.id for node in whereabouts.nodes]
    sources = {link.source for link in whereabouts.links}

    assert (first.cycle, second.cycle, third.cycle) == (1, 2, 3)
    assert [each.codelet for each in second.coalitions] == ["whereabouts"]
    assert whereabouts.id == "3/whereabouts/0"
    assert novelty.id == "3/novelty/0"
    assert nodes == ["self", "object:a"]
    assert sources == {"self", "object:a"}
    assert whereabouts.maps == ["map:0"]


def test_coalitions_are_published_before_what_their_codelets_keep_is_committed() -> None:
    desk = Desk("w1")
    desk.drive(range(1), percept("a"))
    kinds = [type(message) for message in desk.published]
    is_kept = [delta.phase == "attention" for delta in of_type(Delta, desk.published)]
    number = [index for index, kind in enumerate(kinds) if kind is Delta][is_kept.index(True)]

    assert kinds.index(Coalitions) < number
