"""What modules offer to the graph, committed at the beginning of the next cycle."""

from __future__ import annotations

from schemas.codelets import Offer
from schemas.graph import Phase
from schemas.nodes import Episode, Node, Remembered, episode_id
from tests.support.messages import of_type
from tests.support.world.scenes import Desk, agent, thing


def _offer(name: str, cycle: int = 0, source: str = "goal", seq: int = 0) -> Offer:
    return Offer(cycle=cycle, operations=[thing(name)], source=source, seq=seq)


def test_offers_are_committed_at_the_next_cycle_by_source_and_number() -> None:
    desk = Desk("w1")
    offers = [
        _offer("x", source="b", seq=0),
        _offer("y", source="a", seq=1),
        _offer("z", source="a", seq=0),
    ]
    for offer in offers:
        assert desk.feed(offer) == []
    desk.see(0)

    first = desk.deltas[0]
    written = [node.id for node in of_type(Node, first.operations)]
    assert first.phase is Phase.PERCEPTS
    assert written == ["z", "y", "x"]


def test_an_offer_of_what_only_codelets_write_is_rejected_and_counted() -> None:
    desk = Desk("w1")
    offer = Offer(cycle=0, operations=[agent()], source="goal")
    desk.feed(offer)
    desk.drive(range(1))

    (rejecting,) = [delta for delta in desk.deltas if delta.rejected]
    assert rejecting.rejected == 1
    assert "may not write nodes of kind self" in "".join(rejecting.reasons)


def test_in_lockstep_a_cycle_waits_for_the_offers_that_are_declared() -> None:
    desk = Desk("w1", offering=("memory",))
    desk.drive(range(1))
    ended = desk.deltas[-1].cycle
    desk.see(1)
    assert desk.deltas[-1].cycle == ended

    desk.feed(_offer("recalled", cycle=ended, source="memory"))
    assert desk.deltas[-1].cycle == ended + 1
    assert "recalled" in desk.graph.nodes


def test_an_offered_node_is_as_active_as_it_states_when_it_enters() -> None:
    desk = Desk("w1")
    desk.drive(range(5))
    desk.feed(_offer("goal", cycle=5))
    desk.drive(range(5, 6))
    graph = desk.graph
    node = graph.nodes["goal"]

    assert graph.activation(node) == 1.0


def test_an_offered_episode_is_forgotten_once_it_has_decayed() -> None:
    desk = Desk("w1")
    desk.drive(range(1))
    desk.feed(Offer(cycle=1, operations=[_episode()], source="memory"))
    desk.drive(range(1, 2))
    assert episode_id(3) in desk.graph.nodes

    desk.drive(range(2, 9))
    assert episode_id(3) not in desk.graph.nodes
    assert not any(delta.rejected for delta in desk.deltas)


def _episode() -> Episode:
    return Episode(
        id=episode_id(3),
        activation=0.5,
        number=3,
        run=1,
        x_m=1.0,
        y_m=2.0,
        from_ns=0,
        until_ns=10**9,
        content=[Remembered(kind="object", label="bakery")],
    )
