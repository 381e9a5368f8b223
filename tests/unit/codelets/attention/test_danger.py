"""What stands near ahead is brought as a danger, once, with what the place is known by."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Delta, Operation, Phase
from cogmap.schemas.nodes import Attention, attention_id
from cogmap.schemas.sensing import Percept, RangeScan
from cogmap.services.codelets.attention import danger
from cogmap.testing import agent, graph_of, landmark, percept, percepts
from tests.support.world.scenes import run

CONFIG = NoSettings()
BEARINGS_RAD = np.linspace(-0.6, 0.6, 13)
NEAR_M = 2.7
TWO_AHEAD = (0.0, 0.1)


def _scan(range_m: float, at_rad: tuple[float, ...] = TWO_AHEAD) -> RangeScan:
    """Nothing but what stands at those bearings."""
    is_hit = np.isclose(BEARINGS_RAD[:, None], at_rad).any(axis=1)
    ranges_m = np.where(is_hit, range_m, 0.0)
    return RangeScan(
        frame=0, bearing_rad=Array.of(BEARINGS_RAD, "<f4"), range_m=Array.of(ranges_m, "<f4")
    )


FREE = _scan(0.0)
BLOCKED = _scan(NEAR_M)


class Story:
    """An agent that drives towards something, cycle by cycle."""

    def __init__(self, *operations: Operation) -> None:
        self.graph: Graph = graph_of(agent(), *operations)

    def cycle(self, scan: RangeScan | None, *seen: Percept) -> Answer:
        """The answer in the next cycle; nothing where no task is due."""
        self._commit(Phase.LOCALIZATION, [agent()], self.graph.cycle + 1)
        motions = Array.of(np.zeros((0, 5)))
        cycle = self.graph.cycle
        context = CycleContext(cycle, percepts(cycle, *seen), motions, scan=scan)
        answer = Answer()
        for asked in danger.due(context, self.graph, CONFIG):
            answer = run(asked, self.graph, CONFIG)

        self._commit(Phase.ATTENTION, answer.operations, cycle)
        return answer

    def brought(self, scan: RangeScan, number: int) -> int:
        """How many coalitions are brought in so many cycles."""
        return sum(len(self.cycle(scan).coalitions) for _ in range(number))

    def broadcast(self) -> None:
        """What was brought last becomes conscious."""
        memory = self.graph.get(Attention, attention_id("danger"))
        assert memory is not None
        conscious = msgspec.structs.replace(memory, conscious_cycle=self.graph.cycle)
        self._commit(Phase.PERCEPTS, [conscious], self.graph.cycle)

    def _commit(self, phase: Phase, operations: list[Operation], cycle: int) -> None:
        delta = Delta(
            version=self.graph.version + 1, cycle=cycle, phase=phase, operations=operations
        )
        assert self.graph.apply(delta)


def test_what_stands_near_ahead_is_a_danger_to_the_agent_at_the_nearest_object() -> None:
    story = Story(landmark("house"), landmark("tower"))
    seen = [percept("house", range_m=20.0), percept("tower", range_m=8.0)]
    (found,) = story.cycle(BLOCKED, *seen).coalitions

    assert [(node.id, node.salience) for node in found.nodes] == [
        ("self", -1.0),
        ("object:tower", -1.0),
    ]
    assert found.feeling is Feeling.DANGER
    assert found.activation > 0.5


@pytest.mark.parametrize(
    "scan",
    [None, FREE, _scan(6.0), _scan(NEAR_M, (0.0,)), _scan(NEAR_M, (0.5, 0.6))],
    ids=["no scan", "free", "far", "one ray", "aside"],
)
def test_what_is_free_far_aside_or_noise_is_none(scan: RangeScan | None) -> None:
    assert Story().cycle(scan) == Answer()


def test_a_danger_is_brought_until_it_is_conscious_and_then_no_more_while_it_lasts() -> None:
    story = Story()
    assert story.brought(BLOCKED, 4) == 2

    story.broadcast()
    assert story.brought(BLOCKED, 20) == 0


def test_after_a_while_without_one_a_danger_is_another() -> None:
    story = Story()
    story.brought(BLOCKED, 1)
    story.broadcast()

    story.brought(FREE, danger.SAME_CYCLES - 2)
    assert story.brought(BLOCKED, 2) == 0
    story.brought(FREE, danger.SAME_CYCLES + 2)
    assert story.brought(BLOCKED, 1) == 1
