"""Procedural memory as a module: each broadcast brings to mind what could be done about it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from msgspec.structs import replace

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, Behaviours, Broadcast
from cogmap.schemas.graph import Delta
from cogmap.services.procedural.config import Config
from cogmap.services.procedural.guidance.guidance_memory import GuidanceMemory
from cogmap.services.procedural.learning import Reliability
from cogmap.services.procedural.loading import BUILT_IN, load, load_guidance
from cogmap.services.procedural.situations import Situations

__all__ = ["Config", "ProceduralMemory", "build"]

# In lockstep no cycle begins so much later before the action was published: else that is lost.
GIVEN_UP_CYCLES = 2


class ProceduralMemory:
    """Answers each broadcast with the behaviours that schemes become by it.

    In lockstep a broadcast waits for the pose of its cycle, and for the action that was selected
    for the broadcast before it, by which schemes learn. The next cycle but one does not begin
    before that action was published: where a broadcast of it comes, the action was lost.
    """

    def __init__(self, config: Config, graph: Graph, run: Run) -> None:
        self._config = config
        self._is_lockstep = run.lockstep
        self._is_recorded = run.has_any("player")
        self._graph = graph
        path = Path(config.schemes) if config.schemes else BUILT_IN
        self._schemes = load(path)
        self._guidance = GuidanceMemory(load_guidance(path), config.max_guidance_schemes)
        self._reliability = Reliability(self._schemes)
        self._situations = Situations(config.graph_kinds, config.unconscious_share)
        self._waiting: list[Broadcast] = []
        self._unanswered_cycle: int | None = None
        self._last: Behaviours | None = None
        self._resumed_cycle = -1

    def restore(self, past: Iterable[Message]) -> None:
        """Continue with the reliability of schemes as it was published last, and with all guidance
        schemes. What was being learned begins anew.
        """
        for message in past:
            if isinstance(message, Behaviours):
                self._last = message
                self._guidance.restore(message.learned)

        if self._last is not None:
            self._reliability.restore(self._last.behaviours)
            self._resumed_cycle = self._last.cycle

    def last(self) -> Behaviours:
        """Return what was published last, with all that was learned before. Raises MessageError if
        nothing was.
        """
        if self._last is None:
            raise MessageError("there was no broadcast yet")
        return replace(self._last, learned=self._guidance.kept)

    def on_delta(self, delta: Delta) -> list[Behaviours]:
        """Note that the graph has changed."""
        self._situations.on_graph(self._graph, delta.phase)
        return self._due()

    def on_load(self) -> list[Behaviours]:
        """Note that the graph was loaded as a whole."""
        self._situations.on_load(self._graph)
        return self._due()

    def on_broadcast(self, broadcast: Broadcast) -> list[Behaviours]:
        """Bring behaviours to mind, as soon as all is there; no broadcast that waits is of a later
        cycle. After a restart, broadcasts come again that were answered already.
        """
        if broadcast.cycle <= self._resumed_cycle:
            return []

        self._resumed_cycle = -1
        self._waiting = [each for each in self._waiting if each.cycle <= broadcast.cycle]
        self._waiting.append(broadcast)
        return self._due()

    def on_action(self, action: Action) -> list[Behaviours]:
        """Note that a scheme is executed, or that none was active enough.

        In a recording no action moves anything: what follows is no success or failure of it.
        """
        if not self._is_recorded:
            self._reliability.on_action(action)
        self._guidance.on_action(action)
        if self._unanswered_cycle is not None and action.cycle >= self._unanswered_cycle:
            self._unanswered_cycle = None
        return self._due()

    def _due(self) -> list[Behaviours]:
        published = []
        while self._waiting:
            first = self._waiting[0]
            if self._is_lockstep:
                is_lost = self._waiting[-1].cycle >= first.cycle + GIVEN_UP_CYCLES
                is_answered = self._unanswered_cycle is None
                is_settled = self._situations.is_settled(first.cycle)
                if not is_settled or not (is_answered or is_lost):
                    break
            published.append(self._bring_to_mind(self._waiting.pop(0)))
        return published

    def _bring_to_mind(self, broadcast: Broadcast) -> Behaviours:
        nodes = self._situations.of(broadcast)
        self._reliability.judge(nodes, broadcast.stamp_ns)
        learned = self._guidance.on_broadcast(broadcast)

        threshold = self._config.instantiation
        considered = self._guidance.behaviours(broadcast, nodes)
        for scheme in self._schemes:
            behaviour = scheme.considered(nodes, threshold)
            considered.append(self._reliability.noted(behaviour))

        self._unanswered_cycle = broadcast.cycle
        self._last = Behaviours(
            stamp_ns=broadcast.stamp_ns,
            cycle=broadcast.cycle,
            behaviours=considered,
            learned=learned,
        )
        return self._last


def build(config: Config, instance: str, run: Run = REAL_TIME) -> Module:
    """Build the module `procedural`. Raises ConfigError if its schemes cannot be used."""
    graph = Graph(with_places=False)
    memory = ProceduralMemory(config, graph, run)
    published = [topics.BEHAVIOURS]
    return (
        Module("procedural", instance)
        .following(graph, memory.on_delta, emits=published, on_load=memory.on_load)
        .on(topics.BROADCAST, memory.on_broadcast, emits=published)
        .on(topics.ACTION, memory.on_action, emits=published)
        .journaling(topics.BEHAVIOURS, memory.restore, memory.last, backfill=[topics.BROADCAST])
    )
