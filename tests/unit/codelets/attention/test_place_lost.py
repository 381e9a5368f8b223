"""That the agent is lost is brought forward while it is, and that it was found once."""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Delta, Operation, Phase
from cogmap.schemas.nodes import Attention, Misfits, attention_id
from cogmap.services.codelets.attention import place_lost
from cogmap.testing import agent, graph_of, landmark, percepts, task
from tests.support.world.scenes import run

CONFIG = NoSettings()
MEMORY = attention_id("place_lost")


class Story:
    """An agent that is lost and found, cycle by cycle."""

    def __init__(self) -> None:
        self.graph: Graph = graph_of(agent())

    def cycle(self, is_lost: bool) -> Answer:
        """The answer in the next cycle; nothing where no task is due."""
        here = agent(misfits=Misfits(is_lost=is_lost))
        self._commit(Phase.LOCALIZATION, [here], self.graph.cycle + 1)
        motions = Array.of(np.zeros((0, 5)))
        context = CycleContext(self.graph.cycle, percepts(self.graph.cycle), motions)
        answer = Answer()
        for asked in place_lost.due(context, self.graph, CONFIG):
            answer = run(asked, self.graph, CONFIG)

        self._commit(Phase.ATTENTION, answer.operations, self.graph.cycle)
        return answer

    def broadcast(self) -> None:
        """What was brought last becomes conscious."""
        memory = self.graph.get(Attention, MEMORY)
        assert memory is not None
        conscious = msgspec.structs.replace(memory, conscious_cycle=self.graph.cycle)
        self._commit(Phase.PERCEPTS, [conscious], self.graph.cycle)

    def _commit(self, phase: Phase, operations: list[Operation], cycle: int) -> None:
        delta = Delta(
            version=self.graph.version + 1, cycle=cycle, phase=phase, operations=operations
        )
        assert self.graph.apply(delta)


def _saliences(story: Story, *lost: bool) -> list[float]:
    found = []
    for is_lost in lost:
        for coalition in story.cycle(is_lost).coalitions:
            found.append(coalition.nodes[0].salience)
    return found


def test_an_agent_that_knows_where_it_is_brings_nothing() -> None:
    assert _saliences(Story(), False, False, False) == []


def test_to_be_lost_is_bad_and_stays_so() -> None:
    assert _saliences(Story(), True, True, True, True) == [-1.0, -1.0]


def test_to_be_found_is_good_once() -> None:
    story = Story()
    _saliences(story, True, True)

    assert _saliences(story, False) == [1.0]
    story.broadcast()
    assert _saliences(story, False, False, False) == []


def test_that_it_was_found_is_brought_until_it_is_conscious() -> None:
    story = Story()
    _saliences(story, True, True)

    assert _saliences(story, False, False, False, False) == [1.0, 1.0]


def test_what_did_not_fit_is_brought_with_that_the_agent_is_lost() -> None:
    lost = agent(misfits=Misfits(is_lost=True, label="tower"))
    known = graph_of(lost, landmark("tower"), landmark("house"))
    (found,) = run(task("place_lost"), known, CONFIG).coalitions

    assert [node.id for node in found.nodes] == ["self", "object:tower"]
    assert found.feeling is Feeling.LOST


def test_nothing_is_asked_without_a_self_node() -> None:
    assert run(task("place_lost"), graph_of(), CONFIG) == Answer()
