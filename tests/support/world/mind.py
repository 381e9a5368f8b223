"""Long-term memory, asked by hand, and what two runs leave in it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from cogmap.runtime.run import LOCKSTEP, Run
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Broadcast, Coalition, Competition, Trigger
from cogmap.schemas.graph import Delta, Operation, Phase
from cogmap.schemas.memory import (
    Restored,
    Stored,
    StoredEpisode,
    StoredRecord,
)
from cogmap.schemas.nodes import (
    ROOT_MAP,
    AnyNode,
    Episode,
    Map,
    Misfits,
    Object,
    individual_label,
    object_id,
)
from cogmap.services.memory.episodic.config import EpisodicConfig
from cogmap.services.memory.module import Config, build
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.testing import agent, of_type

S = 10**9
SPARSE = SparseConfig(hard_locations=1000, dimensions=512)
BINARY = SparseConfig(kind="binary", hard_locations=1000)
EPISODIC = EpisodicConfig(recall_after_s=0.0, refractory_cycles=0)
LOOKS = ("bakery", "tower", "school")


def config(episodic: EpisodicConfig = EPISODIC, **facts: Any) -> Config:
    """Settings with which each cycle stores and recalls."""
    usual: dict[str, Any] = {"store_cycles": 1, "recall_cycles": 1}
    return Config(episodic=episodic, **({"sparse": SPARSE} | usual | facts))


def seen(*looks: str, salience: float = 0.0) -> list[AnyNode]:
    """Objects that are conscious, one of each of these looks."""
    nodes: list[AnyNode] = []
    for number, look in enumerate(looks):
        label = individual_label(41, number)
        nodes.append(
            Object(
                id=object_id(label),
                label=label,
                names={look: 1.0},
                x_m=0.0,
                y_m=0.0,
                salience=salience,
            )
        )

    return nodes


class Mind:
    """Long-term memory, and what the others publish for it: a cycle a second."""

    def __init__(self, settings: Config | None = None, run: Run = LOCKSTEP) -> None:
        self.module = build(settings or config(), "memory", run)
        self.published: list[Message] = []
        self.cycle = 0
        self._version = 0
        self.commit(Map(id=ROOT_MAP, cell_m=1.0), agent(), _building())

    def commit(self, *operations: Operation, phase: Phase = Phase.OBJECTS) -> None:
        """Commit operations in this cycle."""
        self._version += 1
        delta = Delta(
            stamp_ns=self.cycle * S,
            version=self._version,
            cycle=self.cycle,
            phase=phase,
            operations=list(operations),
        )
        self.published += self.module.feed(delta)

    def live(
        self, at_m: tuple[float, float], *nodes: AnyNode, cycles: int = 1, is_lost: bool = False
    ) -> None:
        """Cycles in which the agent is there, and conscious of these nodes."""
        for _ in range(cycles):
            self.cycle += 1
            self.commit(phase=Phase.END)
            x_m, y_m = at_m
            broadcast = Broadcast(
                stamp_ns=self.cycle * S,
                cycle=self.cycle,
                trigger=Trigger.AGGREGATE,
                coalition=Coalition(
                    codelet="whereabouts",
                    activation=0.5,
                    nodes=[agent(x_m=x_m, y_m=y_m, misfits=Misfits(is_lost=is_lost)), *nodes],
                    maps=[ROOT_MAP],
                ),
            )
            competition = Competition(cycle=self.cycle, contenders=[], trigger=Trigger.AGGREGATE)
            self.published += self.module.feed(broadcast) + self.module.feed(competition)

    def records(self) -> dict[str, StoredRecord]:
        """What a database holds now of what it began with and what was published since."""
        kept: dict[str, StoredRecord] = {}
        for stored in of_type(Stored, self.published):
            kept |= {record.key: record for record in stored.records}
            for key in stored.forgotten:
                kept.pop(key, None)
        return kept

    def episodes(self) -> list[StoredEpisode]:
        """The episodes among them, by number."""
        found = of_type(StoredEpisode, self.records().values())
        return sorted(found, key=lambda episode: episode.number)

    def recalled(self) -> list[Episode]:
        """The episodes that were offered."""
        return of_type(Episode, offered(self.published))


def offered(published: Iterable[Message]) -> list[Operation]:
    """The operations of all offers."""
    return [each for offer in of_type(Offer, published) for each in offer.operations]


def _building() -> Object:
    return Object(id="object:mill", label="mill", x_m=5.0, y_m=5.0, sightings=9)


def first_run(place_m: tuple[float, float] = (3.0, 4.0)) -> list[StoredRecord]:
    """What a run stored that stood at a place, and went on."""
    mind = Mind()
    mind.live(place_m, *seen(*LOOKS, salience=0.5), cycles=20)
    mind.live((60.0, 0.0), *seen("kiosk"), cycles=3)
    return list(mind.records().values())


def second_run(
    records: Iterable[StoredRecord], settings: Config | None = None, run: Run = LOCKSTEP
) -> Mind:
    """A run that begins with these, on the map of the first one."""
    mind = Mind(settings, run)
    mind.module.feed(Restored(records=list(records)))
    mind.commit(Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:1"))
    return mind
