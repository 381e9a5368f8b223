"""Episodic memory: what was conscious, where and when (beyond the paper, which leaves long-term
memory open).

Transient Episodic Memory has each episode from its beginning, and loses it within hours.
Declarative Memory has those that were still active by then. Both are cued by what is conscious.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.schemas import nodes
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.graph import Delta
from cogmap.schemas.memory import Stored, StoredRecord
from cogmap.schemas.nodes import RECOLLECTION_ID, ROOT_MAP, Map, Recollection, Self, episode_id
from cogmap.services.memory.config import Config
from cogmap.services.memory.episodic.corrections import Corrections, Shift
from cogmap.services.memory.episodic.cues import EpisodicCues
from cogmap.services.memory.episodic.episodes import Episodes, KeptEpisode, is_episode
from cogmap.services.memory.episodic.visit import Position, Visit
from cogmap.services.memory.storing import Changes

PATH = 3
"""So many places before that of an episode belong to it."""

LEARNING_RATE = 0.02
"""What a further broadcast adds to an episode's activation, times that of the coalition."""

MIN_MATCH = 0.3
"""How well an episode must match what is conscious to be recalled: half of the content at one place
is 0.35, and what is unrelated 0.
"""


class EpisodicMemory:
    """The episodes of all runs, and the one that lasts."""

    def __init__(self, config: Config, graph: Graph) -> None:
        self._config = config.episodic
        self._sparse = config.sparse
        self._graph = graph
        self._episodes = Episodes(config.episodic)
        self._cues: EpisodicCues | None = None

        self._run = 1
        self._has_begun = False
        self._map = ""
        self._recollection: Recollection | None = None
        self._corrections = Corrections()
        self._broadcasts: list[Broadcast] = []
        self._visits: list[Visit] = []
        self._cued_ns = 0
        self._offered_cycle: int | None = None
        self._offered_visit = 0

    def restore(self, records: Iterable[StoredRecord]) -> None:
        """Take up the episodes that the database holds."""
        self._episodes.restore(records)
        if not self._has_begun:
            runs = [episode.run for episode in self._episodes.known.values()]
            self._run = 1 + max(runs, default=0)
        self._has_begun = True

    def resume(self, past: Iterable[Stored]) -> None:
        """Continue the run in which this was stored."""
        for stored in past:
            self._episodes.restore(stored.records)
            for record in filter(is_episode, stored.records):
                if record.run >= self._run:
                    self._has_begun = True
                    self._run = record.run
                    self._map = record.map

    def learned(self) -> list[StoredRecord]:
        """Return the episodes of this run."""
        return [each for each in self._episodes.known.values() if each.run == self._run]

    def note(self, delta: Delta) -> None:
        """Note a recalled map, into whose frame the root map may be moved, and corrections."""
        self._corrections.note(delta.operations)
        for operation in delta.operations:
            if isinstance(operation, Recollection):
                self._recollection = operation

    def note_all(self) -> None:
        """Note a recalled map and a correction in a graph that was loaded as a whole."""
        self._corrections.note_all(self._graph)
        found = self._graph.get(Recollection, RECOLLECTION_ID)
        self._recollection = found or self._recollection

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Keep what is conscious until its cycle is over."""
        self._broadcasts.append(broadcast)

    def experience(self, cycle: int) -> None:
        """Take in what was broadcast before `cycle`, and follow the root map where it was corrected
        and into another frame.
        """
        due = [each for each in self._broadcasts if each.cycle < cycle]
        self._broadcasts = [each for each in self._broadcasts if each.cycle >= cycle]
        for broadcast in due:
            self._take(broadcast)

        for rows in self._corrections.take():
            self._correct(rows)

        root = self._graph.get(Map, ROOT_MAP)
        if root is not None and root.remembered and root.remembered != self._map:
            self._join(root.remembered)

    def changes(self, map_name: str, now_ns: int) -> Changes:
        """Return what is to be stored, with the root map called `map_name`."""
        self._map = map_name
        self._episodes.consolidate(self._run, now_ns)
        for visit in self._visits:
            if visit.has_content:
                self._episodes.put(visit.episode(self._run, map_name))

        self._visits = self._visits[-1:]
        return self._episodes.take_changes()

    def recall(self, cycle: int, now_ns: int) -> nodes.Episode | None:
        """Recall the episode that what is conscious here reminds of, if it is new; one a visit."""
        offered = self._offered_cycle
        waits = offered is not None and cycle - offered <= self._config.refractory_cycles
        if waits or not self._map or not self._visits:
            return None

        visit = self._visits[-1]
        is_done = visit.number == self._offered_visit or visit.until_ns == self._cued_ns
        if is_done or not visit.has_content:
            return None

        self._cued_ns = visit.until_ns
        found = self._recalled(visit, now_ns)
        if found is None:
            return None

        self._offered_cycle = cycle
        self._offered_visit = visit.number
        return found

    def _recalled(self, visit: Visit, now_ns: int) -> nodes.Episode | None:
        ended = {
            number: episode
            for number, episode in self._episodes.known.items()
            if number != visit.number
        }
        if not ended:
            return None

        if self._cues is None:
            self._cues = EpisodicCues(self._sparse)
        self._cues.hold(ended)

        def is_wanted(number: int) -> bool:
            episode = ended[number]
            ago_ns = now_ns - episode.until_ns
            return episode.run != self._run or ago_ns >= self._config.recall_after_s * 1e9

        found = self._cues.recalled(visit.episode(self._run, self._map), is_wanted)
        if found is None or found.match < MIN_MATCH:
            return None
        return _node(ended[found.number], found.match)

    def _take(self, broadcast: Broadcast) -> None:
        """Let a broadcast be part of the episode that lasts, or begin the next one."""
        coalition = broadcast.coalition
        amount = LEARNING_RATE * coalition.activation
        for node in coalition.nodes:
            if isinstance(node, nodes.Episode):
                self._episodes.reinforce(node.number, amount, broadcast.stamp_ns)

        agent = next((node for node in coalition.nodes if isinstance(node, Self)), None)
        if agent is None or agent.map != ROOT_MAP or agent.misfits.is_lost:
            return

        at_m = (agent.x_m, agent.y_m)
        if self._visits and self._visits[-1].includes(at_m):
            self._visits[-1].reinforce(amount)
        else:
            path: list[Position] = []
            if self._visits:
                before = self._visits[-1]
                path = [before.at_m, *before.path][:PATH]

            visit = Visit(
                number=self._episodes.next_number(),
                at_m=at_m,
                path=path,
                from_ns=broadcast.stamp_ns,
                until_ns=broadcast.stamp_ns,
                activation=coalition.activation,
            )
            self._visits.append(visit)
        self._visits[-1].add(broadcast)

    def _correct(self, rows: Floats) -> None:
        """Move the places of the root map's episodes as a correction, (n, 7), states."""
        shift = Shift(rows)

        def moved(episode: KeptEpisode) -> KeptEpisode:
            if episode.map != self._map:
                return episode

            at_m, *path = shift([(episode.x_m, episode.y_m), *episode.path])
            return msgspec.structs.replace(episode, x_m=at_m[0], y_m=at_m[1], path=path)

        self._relocate(moved)
        for visit in self._visits:
            visit.at_m, *visit.path = shift([visit.at_m, *visit.path])

    def _relocate(self, moved: Callable[[KeptEpisode], KeptEpisode | None]) -> None:
        """Put episodes elsewhere, or forget them, and recall them where they are then."""
        relocated = self._episodes.relocate(moved)
        if self._cues is not None:
            known = self._episodes.known.values()
            self._cues.hold({each.number: each for each in known if each.number not in relocated})

    def _join(self, name: str) -> None:
        """Move what happened in this run into the frame of the map `name`, which was joined to the
        root map. If it is not known how that lies, what happened before is forgotten.
        """
        recollection = self._recollection
        pose: Floats | None = None
        if recollection is not None and recollection.map == name:
            pose = np.array([recollection.x_m, recollection.y_m, recollection.heading_rad])

        def moved(episode: KeptEpisode) -> KeptEpisode | None:
            if episode.map == name or episode.run != self._run:
                return episode
            if pose is None:
                return None

            at_m, *path = _moved(pose, [(episode.x_m, episode.y_m), *episode.path])
            return msgspec.structs.replace(episode, map=name, x_m=at_m[0], y_m=at_m[1], path=path)

        self._map = name
        self._relocate(moved)
        if pose is None:
            self._visits = []
        for visit in self._visits:
            assert pose is not None
            visit.at_m, *visit.path = _moved(pose, [visit.at_m, *visit.path])


def _moved(pose: Floats, places_m: list[Position]) -> list[Position]:
    """Move places into the frame in which their own frame has that pose."""
    rows = transform_from(pose, np.array(places_m)).tolist()
    return [(x_m, y_m) for x_m, y_m in rows]


def _node(episode: KeptEpisode, match: float) -> nodes.Episode:
    """Make the node as which an episode on the root map is offered: the better it matches, the more
    active it is, and the stronger the feeling of that time is felt again.
    """
    felt = max((node.salience for node in episode.content), key=abs, default=0.0)
    return nodes.Episode(
        id=episode_id(episode.number),
        activation=match,
        salience=match * felt,
        number=episode.number,
        run=episode.run,
        x_m=episode.x_m,
        y_m=episode.y_m,
        from_ns=episode.from_ns,
        until_ns=episode.until_ns,
        content=episode.content,
    )
