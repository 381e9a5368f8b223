"""Which forgotten objects come back: those near the agent, or near what is conscious. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from cogmap.graph.graph import Graph
from cogmap.graph.individuals import is_among
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    Object,
    object_id,
    percept_id,
)
from cogmap.services.memory.config import Config

Position = tuple[float, float]

CUE_WITHIN_M = 50.0
"""Distance from the agent, or from an object that is conscious, within which an object comes back:
somewhat farther than it is seen from.
"""


class ObjectCues:
    """The objects that were conscious since forgotten ones were last cued."""

    def __init__(self, config: Config, graph: Graph) -> None:
        self._config = config
        self._graph = graph
        self._conscious: list[tuple[int, str]] = []

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Keep what is conscious until its cycle is over."""
        for node in broadcast.coalition.nodes:
            if isinstance(node, Object):
                self._conscious.append((broadcast.cycle, node.id))

    def cued(self, cycle: int, forgotten: Sequence[Object]) -> list[Object]:
        """Return the nodes as which forgotten objects come back, the nearest first; none while the
        map is about to move.
        """
        cues_m = self._places_m(cycle)
        is_moving = {CORRECTION_ID, RECOLLECTION_ID} & self._graph.nodes.keys()
        if is_moving or not cues_m or not forgotten:
            return []

        present = list(self._graph.of_kind(Object))
        found = []
        for node in forgotten:
            away_m = min(math.dist(cue_m, (node.x_m, node.y_m)) for cue_m in cues_m)
            if away_m > CUE_WITHIN_M or is_among(node, present):
                continue
            if not {object_id(node.label), percept_id(node.label)} & self._graph.nodes.keys():
                found.append((away_m, node.label, node))

        # As they were known, expected to be where they stood.
        found.sort(key=lambda each: each[:2])
        return [
            msgspec.structs.replace(node, activation=0.0, salience=0.0, cycle=0, misses=0)
            for _, _, node in found[: self._config.max_returned]
        ]

    def _places_m(self, cycle: int) -> list[Position]:
        """List where the agent knows it is, and where what was broadcast before `cycle` stands."""
        places_m = []
        agent = self._graph.agent
        if agent is not None and agent.map == ROOT_MAP and not agent.misfits.is_lost:
            places_m.append((agent.x_m, agent.y_m))

        names = {name for number, name in self._conscious if number < cycle}
        self._conscious = [each for each in self._conscious if each[0] >= cycle]
        for name in sorted(names):
            node = self._graph.get(Object, name)
            if node is not None and node.map == ROOT_MAP:
                places_m.append((node.x_m, node.y_m))

        return places_m
