"""An attention codelet that has brought a coalition waits, and the graph keeps that it has."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import Attention, Need, attention_id, need_id
from cogmap.services.codelets.attention import need
from cogmap.services.codelets.attention.pending import is_refractory, without_conscious
from cogmap.testing import agent, graph_of, landmark, percept, percepts, task
from tests.support.world.scenes import run

NOTHING = NoSettings()
NO_MOTION = Array.of(np.zeros((0, 5)))


def _scene() -> Graph:
    energy = Need(id=need_id("energy"), label="energy", level=0.9, activation=1.0)
    return graph_of(agent(), landmark("house", sightings=1), energy)


def _context(cycle: int) -> CycleContext:
    return CycleContext(cycle, percepts(cycle, percept("house")), NO_MOTION)


def _after(graph: Graph, codelet: str) -> Graph:
    """The graph after `codelet` has brought a coalition in cycle 1."""
    asked = task(codelet, percepts=[percept("house")])
    answer = run(asked, graph, NOTHING)
    assert len(answer.coalitions) == 1

    delta = Delta(version=2, cycle=1, phase=Phase.ATTENTION, operations=answer.operations)
    assert graph.apply(delta)
    return graph


@pytest.mark.parametrize(("waits", "cycles"), [(0, [2, 3, 4]), (1, [3, 4]), (2, [4])])
def test_a_codelet_waits_for_its_refractory_period(waits: int, cycles: list[int]) -> None:
    graph = _after(_scene(), "novelty")

    ready = [cycle for cycle in (2, 3, 4) if not is_refractory("novelty", graph, cycle, waits)]
    assert ready == cycles


def test_the_default_codelet_brings_what_is_in_view_in_each_cycle_and_keeps_nothing() -> None:
    answer = run(task("whereabouts", percepts=[percept("house")]), _scene(), NOTHING)

    assert len(answer.coalitions) == 1
    assert answer.operations == []


def test_codelets_wait_for_themselves_alone() -> None:
    graph = _after(_scene(), "novelty")

    assert len(need.due(_context(2), graph, need.Config())) == 1


def test_a_restored_graph_keeps_codelets_waiting() -> None:
    restored = Graph()
    restored.load(_after(_scene(), "need").snapshot())

    assert need.due(_context(5), restored, need.Config()) == []
    assert len(need.due(_context(6), restored, need.Config())) == 1


@pytest.mark.parametrize(("conscious", "pending"), [(0, 2), (6, 2), (7, 1), (9, 0)])
def test_what_was_brought_is_pending_until_a_broadcast_since(conscious: int, pending: int) -> None:
    memory = Attention(
        id=attention_id("a"),
        codelet="a",
        conscious_cycle=conscious,
        pending={"first": 7, "second": 8},
    )

    assert len(without_conscious(memory).pending) == pending
    never_brought = msgspec.structs.replace(memory, pending={"new": 0})
    assert without_conscious(never_brought).pending == {"new": 0}
