"""What modules offer to the graph, committed at the beginning of the next cycle."""

from __future__ import annotations

from cogmap.runtime.run import Run
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import (
    Episode,
    LinkKind,
    Node,
    Object,
    Remembered,
    episode_id,
    object_id,
    place_id,
)
from cogmap.testing import agent, landmark, of_type, percept
from tests.support.world.scenes import Desk, thing

OFFERED = Run(lockstep=True, participants={"memory": 1})


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
    desk = Desk("w1", run=OFFERED)
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


def _recalled(label: str, x_m: float, **facts: object) -> Offer:
    usual = {"base_level": 0.5, "names": {"inn": 9.0}, "width_m": 8.0, "sightings": 9}
    node = landmark(label, [(x_m, 60.0)], **(usual | facts))
    return Offer(cycle=0, operations=[thing("beside"), node], source="memory")


def test_an_object_that_memory_recalls_is_on_the_map_at_its_place() -> None:
    desk = Desk("w1")
    desk.drive(range(1))
    desk.feed(_recalled("41a", 30.2))
    desk.drive(range(1, 2))
    graph = desk.graph
    inn = graph.get(Object, object_id("41a"))

    assert inn is not None
    assert (inn.name, graph.base_level(inn), inn.sightings) == ("inn", 0.5, 9)
    assert graph.links.target(inn.id, LinkKind.AT) == place_id(30, 60)


def test_an_object_that_is_on_the_map_already_is_not_accepted_and_the_rest_of_its_offer_is() -> (
    None
):
    desk = Desk("w1")
    desk.drive(range(1))
    for offer in (_recalled("41a", 30.0), _recalled("41a", 90.0), _recalled("52b", 32.0)):
        desk.feed(offer)
    desk.drive(range(1, 2))
    objects = {node.label: node.x_m for node in desk.graph.of_kind(Object)}

    assert objects == {"41a": 30.0}
    assert "beside" in desk.graph.nodes
    assert sum(delta.rejected for delta in desk.deltas) == 2


def test_one_that_looks_alike_beside_an_object_of_the_map_is_accepted() -> None:
    desk = Desk("w1")
    desk.drive(range(1))
    for offer in (_recalled("41a", 30.0), _recalled("52b", 40.0)):
        desk.feed(offer)
    desk.drive(range(1, 2))

    assert sorted(node.label for node in desk.graph.of_kind(Object)) == ["41a", "52b"]


def test_an_object_that_is_offered_with_the_name_that_a_person_gave_it_is_called_so() -> None:
    desk = Desk("w1")
    desk.drive(range(1))
    desk.feed(_recalled("41a", 30.0))
    desk.drive(range(1, 2))
    desk.feed(_recalled("41a", 90.0, given_name="the old inn"))
    desk.drive(range(2, 3))
    (inn,) = desk.graph.of_kind(Object)

    assert (inn.name, inn.look, inn.x_m) == ("the old inn", "inn", 30.0)


def test_an_object_by_whose_label_another_is_seen_right_now_is_not_accepted() -> None:
    desk = Desk("w1")
    desk.drive(range(1))
    desk.feed(_recalled("41a", 30.0))
    desk.drive(range(1, 2), percept("41a"))
    (inn,) = desk.graph.of_kind(Object)

    assert inn.x_m < 20.0
