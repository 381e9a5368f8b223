"""Activation decays as it is read, and what falls below threshold is forgotten."""

from __future__ import annotations

from typing import get_args

import msgspec
import pytest

from cogmap.graph import decay
from cogmap.graph.graph import Graph
from cogmap.graph.places import Place
from cogmap.schemas.graph import Decay, Delta, DropNode, Link, Phase
from cogmap.schemas.nodes import KINDS, AnyNode, Node, PlaceColumn, coarse_map_id
from cogmap.services.workspace.forgetting import Forgetting
from cogmap.testing import agent, cells, of_type, percept
from tests.support.world.scenes import Desk

RATES = Decay(activation=0.1, base_level=0.0005, place_activation=0.02, forget_below=0.05)
HERE = (-3, 70)
COARSE_MAPS = [coarse_map_id(level) for level in (1, 2)]


def _node(name: str, activation: float, base_level: float = 0.0) -> Node:
    return Node(id=name, kind="thing", activation=activation, base_level=base_level)


class _Run:
    """A graph whose cycles end one after another."""

    def __init__(self, *operations: object, rates: Decay = RATES) -> None:
        self.graph = Graph()
        self.forgetting = Forgetting()
        self.commit(Phase.OBJECTS, [rates, *operations])

    def commit(self, phase: Phase, operations: list[object], cycle: int = 0) -> None:
        delta = Delta(
            version=self.graph.version + 1,
            cycle=cycle or self.graph.cycle,
            phase=phase,
            operations=operations,  # type: ignore[arg-type]
        )
        assert self.graph.apply(delta)
        self.forgetting.note(delta, self.graph)

    def end_cycles(self, number: int = 1) -> list[str]:
        """What is forgotten at the end of so many cycles; the next has begun."""
        forgotten = []
        for _ in range(number):
            due = self.forgetting.due(self.graph)
            forgotten += [drop.id for drop in due]
            self.commit(Phase.END, [*due])
            self.commit(Phase.PERCEPTS, [], self.graph.cycle + 1)
        return forgotten


def test_activation_decays_by_a_tenth_a_cycle_and_base_level_by_far_less() -> None:
    run = _Run(_node("a", 0.9, 0.5))
    run.end_cycles(3)
    node = run.graph.nodes["a"]

    assert run.graph.activation(node) == pytest.approx(0.6)
    assert run.graph.base_level(node) == pytest.approx(0.4985)
    assert run.graph.total_activation(node) == 1.0


def test_activation_never_falls_below_zero() -> None:
    run = _Run(_node("a", 0.05, 0.5))
    run.end_cycles(3)

    assert run.graph.activation(run.graph.nodes["a"]) == 0.0


def test_persistent_kinds_do_not_decay() -> None:
    run = _Run(agent())
    assert run.end_cycles(100) == []

    node = run.graph.nodes["self"]
    assert run.graph.activation(node) == 1.0
    assert run.graph.base_level(node) == 1.0


def test_what_falls_below_threshold_is_forgotten_with_its_links() -> None:
    near = Link(source="b", target="a", kind="near")
    run = _Run(_node("a", 0.3), _node("b", 1.0, 0.5), near)

    assert run.end_cycles(2) == []
    assert run.end_cycles() == ["a"]
    assert sorted(run.graph.nodes) == ["b"]
    assert run.graph.snapshot().links == []


def test_base_level_keeps_a_node_that_activation_alone_would_not() -> None:
    seen_once = _node("seen once", 1.0, 0.0)
    learned = _node("learned", 0.0, 0.2)
    run = _Run(seen_once, learned)
    run.end_cycles(20)

    assert list(run.graph.nodes) == ["learned"]


def test_a_node_that_is_written_again_is_forgotten_later() -> None:
    run = _Run(_node("a", 0.3))
    run.end_cycles(2)
    again = Node(id="a", kind="thing", activation=0.3, cycle=run.graph.cycle)
    run.commit(Phase.OBJECTS, [again])

    assert run.end_cycles(2) == []
    assert run.end_cycles() == ["a"]


def test_a_restored_graph_forgets_what_the_one_before_would_have() -> None:
    nodes = [_node(f"n{number}", 0.1 + number / 20, number / 1000) for number in range(20)]
    before = _Run(*nodes)
    before.end_cycles(4)
    after = _Run()
    after.graph.load(before.graph.snapshot())
    after.forgetting.restore(after.graph)

    expected = [before.end_cycles() for _ in range(8)]
    found = [after.end_cycles() for _ in range(8)]
    assert any(expected)
    assert found == expected


@pytest.mark.parametrize("base_level", [0.0, 0.03, 0.2])
@pytest.mark.parametrize("activation", [0.0, 0.04, 0.05, 0.35, 1.0])
def test_the_cycle_of_forgetting_is_the_last_above_threshold(
    activation: float, base_level: float
) -> None:
    node = Node(id="a", kind="thing", activation=activation, base_level=base_level, cycle=7)
    cycle = decay.cycle_of_forgetting(node, RATES)

    assert decay.total_activation(node, cycle + 1, RATES) < RATES.forget_below
    if cycle > 7:
        assert decay.total_activation(node, cycle, RATES) >= RATES.forget_below


def test_without_decay_nothing_is_forgotten() -> None:
    node = _node("a", 0.5)
    threshold_alone = Decay(forget_below=0.1)
    decay_alone = Decay(activation=0.1)

    assert decay.cycle_of_forgetting(node, threshold_alone) == decay.NEVER
    assert decay.cycle_of_forgetting(node, decay_alone) == decay.NEVER


def _place(graph: Graph) -> Place:
    place = graph.place(*HERE)
    assert place is not None
    return place


def test_the_activation_of_place_nodes_decays_to_zero() -> None:
    run = _Run(cells(PlaceColumn.ACTIVATION, {HERE: 0.05}))
    trace = []
    for _ in range(4):
        trace.append(_place(run.graph).activation)
        run.end_cycles()

    assert trace == pytest.approx([0.05, 0.03, 0.01, 0.0], abs=1e-6)


def test_road_does_not_decay() -> None:
    run = _Run(cells(PlaceColumn.ROAD, {HERE: 1.0}))
    run.end_cycles(10)

    assert _place(run.graph).road == 1.0


def test_a_cycle_in_which_nothing_is_forgotten_writes_nothing_at_its_end() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("a"))
    written = [delta.operations for delta in desk.deltas if delta.phase is Phase.END]

    assert written == [[], [], []]


def test_an_object_that_is_no_longer_seen_stays_and_its_percept_is_forgotten() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("a"))
    desk.drive(range(3, 15))
    maps = {"map:0", "map:1", *COARSE_MAPS}
    kept = {"attention:novelty", "self", *maps}
    expected = kept | {"path:0", "observations:0:a", "object:a"}
    assert set(desk.graph.nodes) == expected

    dropped = []
    for delta in desk.deltas:
        dropped += [drop.id for drop in of_type(DropNode, delta.operations)]
    assert dropped == ["percept:a"]


def test_a_replica_decays_as_the_workspace_does() -> None:
    desk = Desk("w1", decay=0.3, base_level_decay=0.1)
    desk.drive(range(2), percept("a"), percept("b", 0.7))
    desk.drive(range(2, 12))

    maps = {"map:0", *COARSE_MAPS}
    kept = {"attention:novelty", "self", *maps}
    expected = kept | {"path:0", "observations:0:a", "observations:0:b"}

    assert set(desk.graph.nodes) == expected
    assert desk.graph.digest() == desk.digest


def test_every_kind_has_rules() -> None:
    kinds = set(get_args(AnyNode))

    assert kinds
    assert kinds <= set(KINDS)


def test_a_base_level_that_was_learned_well_is_kept_and_no_other() -> None:
    rates = msgspec.structs.replace(RATES, base_level=0.1, kept_base_level=0.5)
    run = _Run(
        _node("well", 0.0, 0.8), _node("just", 0.0, 0.5), _node("less", 0.0, 0.45), rates=rates
    )
    forgotten = run.end_cycles(100)

    assert forgotten == ["less"]
    assert run.graph.base_level(run.graph.nodes["well"]) == 0.5
    assert run.graph.base_level(run.graph.nodes["just"]) == 0.5
