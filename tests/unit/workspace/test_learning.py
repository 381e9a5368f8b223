"""The workspace learns from what became conscious, once, and from nothing that was merely seen."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas.cognition import Broadcast, Coalition, Competition, Trigger
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Decay, Phase
from cogmap.schemas.nodes import (
    AnyNode,
    Attention,
    Node,
    Object,
    attention_id,
    object_id,
)
from cogmap.services.workspace.learning.base_level import learned_operations
from cogmap.testing import agent, graph_of, landmark, percept, percepts, self_motion
from tests.support.world.scenes import Desk

CONSCIOUS = Run(lockstep=True, participants={"global_workspace": 1})


def _broadcast(
    *nodes: AnyNode, cycle: int = 1, codelet: str = "test", feeling: Feeling = Feeling.NONE
) -> Broadcast:
    coalition = Coalition(codelet=codelet, activation=0.5, nodes=list(nodes), feeling=feeling)
    return Broadcast(cycle=cycle, trigger=Trigger.ONE_COALITION, coalition=coalition)


def _learned(node: AnyNode, told: AnyNode) -> list[AnyNode]:
    graph = graph_of(node)
    return learned_operations([_broadcast(told)], graph, 1)  # type: ignore[return-value]


def test_what_was_conscious_has_a_higher_base_level() -> None:
    house = landmark("house", base_level=0.2)
    (learned,) = _learned(house, house)

    assert isinstance(learned, Object)
    assert learned.base_level == pytest.approx(0.3)
    assert learned.offsets_m == house.offsets_m


def test_what_is_persistent_or_forgotten_learns_nothing() -> None:
    assert _learned(agent(), agent()) == []
    assert _learned(landmark("a"), landmark("b")) == []


def test_two_broadcasts_teach_twice() -> None:
    house = landmark("house", base_level=0.2)
    both = [_broadcast(house, cycle=1), _broadcast(house, cycle=2)]
    (learned,) = learned_operations(both, graph_of(house), 3)

    assert isinstance(learned, Object)
    assert learned.base_level == pytest.approx(0.4)


def test_activation_decays_as_it_would_have() -> None:
    node = Node(id="a", kind="thing", activation=0.5, base_level=0.5, cycle=1)
    rates = Decay(activation=0.1, base_level=0.01)
    (learned,) = learned_operations([_broadcast(node)], graph_of(rates, node), 3)

    assert isinstance(learned, Node)
    assert (learned.activation, learned.cycle) == (pytest.approx(0.3), 3)
    assert learned.base_level == pytest.approx(0.58)


def test_what_is_broadcast_as_missing_is_unlearned() -> None:
    house = landmark("house", base_level=0.9)
    missing = msgspec.structs.replace(house, salience=-1.0)
    told = _broadcast(missing, feeling=Feeling.SURPRISE)
    (learned,) = learned_operations([told], graph_of(house), 1)

    assert isinstance(learned, Object)
    assert learned.base_level == pytest.approx(0.5)
    assert learned.salience == 0.0


def test_what_is_dangerous_is_learned_as_what_is_not() -> None:
    house = landmark("house", base_level=0.2)
    dangerous = msgspec.structs.replace(house, salience=-1.0)
    told = _broadcast(dangerous, feeling=Feeling.DANGER)
    (learned,) = learned_operations([told], graph_of(house), 1)

    assert isinstance(learned, Object)
    assert learned.base_level == pytest.approx(0.3)


def test_the_codelet_of_a_broadcast_keeps_that_it_was_conscious() -> None:
    memory = Attention(id=attention_id("novelty"), codelet="novelty", brought_cycle=4)
    told = _broadcast(agent(), cycle=5, codelet="novelty")
    (learned,) = learned_operations([told], graph_of(memory), 6)

    assert learned == msgspec.structs.replace(memory, conscious_cycle=5)


def _base_level(desk: Desk) -> float:
    house = desk.graph.get(Object, object_id("house"))
    assert house is not None
    return desk.graph.base_level(house)


def test_being_seen_excites_an_object_and_teaches_nothing() -> None:
    desk = Desk("w1")
    desk.drive(range(2), percept("house"))
    before = _base_level(desk)
    desk.drive(range(2, 12), percept("house"))
    house = desk.graph.get(Object, object_id("house"))

    assert _base_level(desk) < before
    assert house is not None
    assert house.activation == percept("house").activation


def _compete(desk: Desk, cycle: int, *nodes: AnyNode) -> None:
    trigger = Trigger.ONE_COALITION if nodes else Trigger.NONE
    desk.feed(Competition(cycle=cycle, contenders=[], trigger=trigger))
    if nodes:
        desk.feed(_broadcast(*nodes, cycle=cycle))


def _begun(desk: Desk) -> list[int]:
    return [delta.cycle for delta in desk.deltas if delta.phase is Phase.PERCEPTS]


def test_in_lockstep_a_cycle_waits_for_the_competition_before_and_its_broadcast() -> None:
    desk = Desk("w1", run=CONSCIOUS)
    desk.drive(range(1), percept("house"))
    desk.see(1, percept("house"))
    assert _begun(desk) == [1]

    desk.feed(Competition(cycle=1, contenders=[], trigger=Trigger.ONE_COALITION))
    assert _begun(desk) == [1]

    desk.feed(_broadcast(landmark("house")))
    assert _begun(desk) == [1, 2]


def test_what_arrives_first_changes_nothing() -> None:
    digests = []
    for is_early in (True, False):
        desk = Desk("w1", run=CONSCIOUS)
        desk.drive(range(1), percept("house"))
        if is_early:
            _compete(desk, 1, landmark("house"))
        desk.see(1, percept("house"))
        if not is_early:
            _compete(desk, 1, landmark("house"))
        desk.work()
        digests.append(desk.digest)

    assert digests[0] == digests[1]


def test_a_cycle_learns_from_each_broadcast_once() -> None:
    desk = Desk("w1", run=CONSCIOUS)
    desk.drive(range(1), percept("house"))
    before = _base_level(desk)
    _compete(desk, 1, landmark("house"))
    desk.drive(range(1, 2), percept("house"))
    learned = _base_level(desk)
    _compete(desk, 2)
    desk.feed(_broadcast(landmark("house"), cycle=1))
    desk.drive(range(2, 3), percept("house"))

    assert learned > before
    assert _base_level(desk) < learned


def test_a_view_that_is_repeated_begins_its_cycle_without_a_competition_that_was_lost() -> None:
    desk = Desk("w1", run=CONSCIOUS)
    desk.drive(range(1))
    desk.see(1)
    assert _begun(desk) == [1]

    desk.feed(self_motion(1))
    desk.feed(percepts(1))
    assert _begun(desk) == [1, 2]


def test_a_restored_workspace_waits_for_no_competition_before_and_learns_what_is_left() -> None:
    desk = Desk("w1", run=CONSCIOUS)
    desk.drive(range(1), percept("house"))
    again = Desk("w1", run=CONSCIOUS)
    assert again.module.restore is not None
    again.module.restore(desk.deltas)

    again.feed(_broadcast(landmark("house"), cycle=1))
    again.see(1, percept("house"))

    (delta, *_) = again.deltas
    taught = [node for node in delta.operations if isinstance(node, Object)]
    assert [node.id for node in taught] == [object_id("house")]


def test_in_real_time_a_cycle_takes_what_has_come() -> None:
    desk = Desk("w1", run=REAL_TIME)
    desk.drive(range(1), percept("house"))
    desk.see(1, percept("house"))

    assert _begun(desk) == [1, 2]
