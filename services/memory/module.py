"""Long-term memory as a module."""

from __future__ import annotations

from collections.abc import Iterable

from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Broadcast, Competition
from cogmap.schemas.graph import Delta, Operation, Phase
from cogmap.schemas.memory import Restored, Stored
from cogmap.schemas.nodes import NEVER_NS, ROOT_MAP
from cogmap.schemas.sensing import RangeScan
from cogmap.services.memory.config import Config
from cogmap.services.memory.episodic.episodic_memory import EpisodicMemory
from cogmap.services.memory.spatial import SpatialMemory

__all__ = ["Config", "LongTermMemory", "build"]


class CompetitionGate:
    """Open for a cycle of lockstep once the competition of the cycle before has come, and its
    broadcast, if there was one: what memory does then depends on nothing but what was sensed.
    """

    def __init__(self) -> None:
        self._competition_cycle = 0
        self._broadcast_cycle = 0
        self._awaits_broadcast = False

    def on_competition(self, competition: Competition) -> None:
        """Note how far the global workspace has come."""
        self._competition_cycle = competition.cycle
        self._awaits_broadcast = bool(competition.trigger)

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Note that a broadcast has come."""
        self._broadcast_cycle = broadcast.cycle

    def resume(self, cycle: int) -> None:
        """Go on in `cycle`, after a restart, or if something was lost: wait for nothing that was
        published before.
        """
        self._competition_cycle = max(self._competition_cycle, cycle - 1)
        self._awaits_broadcast = False

    def is_open(self, cycle: int) -> bool:
        """Decide whether what follows from the end of `cycle` may be computed."""
        is_behind = self._broadcast_cycle < self._competition_cycle
        lacks_broadcast = self._awaits_broadcast and is_behind
        return self._competition_cycle >= cycle - 1 and not lacks_broadcast


class LongTermMemory:
    """At the end of a cycle it stores what has changed on the map, if that was broadcast, with the
    episodes, and offers a map, an episode and forgotten objects that it recalls.
    """

    def __init__(self, config: Config, graph: Graph, run: Run) -> None:
        self._config = config
        self._graph = graph
        self._is_lockstep = run.lockstep
        self._gate = CompetitionGate()
        self._spatial = SpatialMemory(config, graph)
        self._episodic = EpisodicMemory(config, graph)

        self._broadcast_in: list[int] = []
        self._stored_cycle = 0
        self._ended_ns: int | None = None
        self._scan_ns = NEVER_NS
        self._offered: Offer | None = None

    def on_restored(self, restored: Restored) -> None:
        """Take up what the database holds."""
        self._spatial.restore(restored.records)
        self._episodic.restore(restored.records)

    def resume(self, past: Iterable[Message]) -> None:
        """Continue with the map and the episodes of this run after a restart."""
        stored = [message for message in past if isinstance(message, Stored)]
        self._spatial.resume(stored)
        self._episodic.resume(stored)

    def learned(self) -> Stored:
        """Return the records that stand for all that this run has stored."""
        records = [*self._spatial.learned(), *self._episodic.learned()]
        return Stored(cycle=self._graph.cycle, records=records)

    def on_broadcast(self, broadcast: Broadcast) -> list[Message]:
        """Take what is conscious, to learn it."""
        self._gate.on_broadcast(broadcast)
        self._spatial.on_broadcast(broadcast)
        self._episodic.on_broadcast(broadcast)
        if ROOT_MAP in broadcast.coalition.maps:
            self._broadcast_in.append(broadcast.cycle)
        return self._replies()

    def on_competition(self, competition: Competition) -> list[Message]:
        """Note that a cycle's competition has ended."""
        self._gate.on_competition(competition)
        return self._replies()

    def on_scan(self, scan: RangeScan) -> list[Message]:
        """Reply at once to a repeated scan. It shows that everything waits, as after a restart of
        another module: then no broadcast will come. In lockstep the next cycle may have lost the
        last offer, which is made again without its operations.
        """
        is_repeated = scan.stamp_ns == self._scan_ns
        self._scan_ns = scan.stamp_ns
        replies = self._replies(at_once=is_repeated)
        is_lost = is_repeated and self._is_lockstep and not replies
        if is_lost and self._offered is not None:
            return [self._offered]
        return replies

    def on_delta(self, delta: Delta) -> list[Message]:
        """Note what changes; the end of a cycle is the time to store and to recall."""
        self._spatial.note(delta)
        self._episodic.note(delta)
        if delta.phase is not Phase.END:
            return []

        self._ended_ns = delta.stamp_ns
        return self._replies()

    def on_load(self) -> list[Message]:
        """Take up a graph that was loaded as a whole, which may have ended a cycle."""
        self._gate.resume(self._graph.cycle)
        self._spatial.note_all()
        self._episodic.note_all()
        if self._graph.phase is not Phase.END:
            return []

        agent = self._graph.agent
        self._ended_ns = 0 if agent is None else max(0, agent.stamp_ns)
        return self._replies(at_once=True)

    def _replies(self, at_once: bool = False) -> list[Message]:
        """Return what follows from the end of the newest cycle, once that is settled."""
        stamp_ns = self._ended_ns
        cycle = self._graph.cycle
        is_open = at_once or not self._is_lockstep or self._gate.is_open(cycle)
        if stamp_ns is None or not is_open:
            return []

        self._ended_ns = None
        self._episodic.experience(cycle)
        return [*self._store(cycle, stamp_ns), *self._recall(cycle, stamp_ns)]

    def _store(self, cycle: int, stamp_ns: int) -> list[Message]:
        """Store what is new on the map and in episodes, if the map was broadcast before this cycle
        and not stored since.

        A broadcast in this cycle may come sooner or later: it counts in the next.
        """
        was_broadcast = any(each < cycle for each in self._broadcast_in)
        if not was_broadcast or cycle - self._stored_cycle < self._config.store_cycles:
            return []

        self._stored_cycle = cycle
        self._broadcast_in = [each for each in self._broadcast_in if each >= cycle]
        places = self._spatial.changes()
        episodes = self._episodic.changes(self._spatial.name, stamp_ns)
        records = [*places.records, *episodes.records]
        forgotten = [*places.forgotten, *episodes.forgotten]
        if not records and not forgotten:
            return []

        return [Stored(stamp_ns=stamp_ns, cycle=cycle, records=records, forgotten=forgotten)]

    def _recall(self, cycle: int, stamp_ns: int) -> list[Message]:
        """Offer the map, the episode and the objects that are recalled; in lockstep, send an empty
        offer if none is.
        """
        operations: list[Operation] = []
        if cycle % self._config.recall_cycles == 0:
            recollection = self._spatial.recall()
            episode = self._episodic.recall(cycle, stamp_ns)
            operations = [each for each in (recollection, episode) if each is not None]
            if recollection is None:
                operations += self._spatial.returning(cycle)
        if not operations and not self._is_lockstep:
            return []

        self._offered = Offer(stamp_ns=stamp_ns, cycle=cycle, operations=[])
        return [Offer(stamp_ns=stamp_ns, cycle=cycle, operations=operations)]


def build(config: Config, instance: str, run: Run = REAL_TIME) -> Module:
    """Build the module `memory`."""
    graph = Graph()
    memory = LongTermMemory(config, graph, run)
    published = (topics.STORED, topics.OFFER)
    return (
        Module("memory", instance)
        .remembering(memory.on_restored)
        .journaling(topics.STORED, memory.resume, memory.learned)
        .on(topics.SCAN, memory.on_scan, emits=published)
        .following(graph, memory.on_delta, emits=published, on_load=memory.on_load)
        .on(topics.COMPETITION, memory.on_competition, emits=published)
        .on(topics.BROADCAST, memory.on_broadcast, emits=published)
    )
