"""Episodes as the module stores and recalls them: what was conscious, where and when."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.runtime.state.store import Store
from schemas.array import Matrix
from schemas.base import Message
from schemas.codelets import Offer
from schemas.cognition import Broadcast, Coalition, Competition, Trigger
from schemas.graph import Delta, DropNode, Operation, Phase
from schemas.memory import (
    DeclarativeEpisode,
    Restored,
    Stored,
    StoredEpisode,
    StoredObjects,
    StoredRecord,
    TransientEpisode,
)
from schemas.nodes import (
    CORRECTION_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    AnyNode,
    Correction,
    Episode,
    Map,
    Need,
    Object,
    PathColumn,
    PathSegment,
    Recollection,
    Remembered,
    need_id,
    object_id,
    segment_id,
)
from services.memory.episodic.config import EpisodicConfig
from services.memory.module import Config, build
from services.memory.sparse.config import SparseConfig
from tests.support.messages import of_type
from tests.support.world.scenes import agent

S = 10**9
SPARSE = SparseConfig(hard_locations=1000, dimensions=512)
BINARY = SparseConfig(kind="binary", hard_locations=1000)
EPISODIC = EpisodicConfig(recall_after_s=0.0, refractory_cycles=0)
LOOKS = ("bakery", "tower", "school")


def config(episodic: EpisodicConfig = EPISODIC, **facts: Any) -> Config:
    """Settings with which each cycle stores and recalls."""
    usual: dict[str, Any] = {"mode": "lockstep", "store_cycles": 1, "recall_cycles": 1}
    return Config(episodic=episodic, **({"sparse": SPARSE} | usual | facts))


def seen(*looks: str, salience: float = 0.0) -> list[AnyNode]:
    """Objects that are conscious."""
    return [
        Object(id=object_id(look), label=look, x_m=0.0, y_m=0.0, salience=salience)
        for look in looks
    ]


class Mind:
    """Long-term memory, and what the others publish for it: a cycle a second."""

    def __init__(self, settings: Config | None = None) -> None:
        self.module = build(settings or config(), "memory")
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
                    nodes=[agent(x_m=x_m, y_m=y_m, is_lost=is_lost), *nodes],
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


def second_run(records: Iterable[StoredRecord], settings: Config | None = None) -> Mind:
    """A run that begins with these, on the map of the first one."""
    mind = Mind(settings)
    mind.module.feed(Restored(records=list(records)))
    mind.commit(Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:1"))
    return mind


def test_what_is_conscious_at_a_place_is_stored_with_where_and_when() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen("bakery"), cycles=4)

    (episode,) = mind.episodes()
    assert isinstance(episode, TransientEpisode)
    assert (episode.run, episode.map) == (1, "remembered:1")
    assert (episode.x_m, episode.y_m) == (3.0, 4.0)
    assert (episode.from_ns, episode.until_ns) == (1 * S, 3 * S)
    assert episode.content == [Remembered(kind="object", label="bakery")]


def test_the_next_place_is_an_episode_of_its_own_that_has_the_path_to_it() -> None:
    mind = Mind()
    for x_m in (0.0, 4.0, 12.0, 24.0):
        mind.live((x_m, 0.0), *seen("bakery"), cycles=2)
    mind.live((24.0, 0.0))

    assert [episode.x_m for episode in mind.episodes()] == [0.0, 12.0, 24.0]
    assert mind.episodes()[2].path == [(12.0, 0.0), (0.0, 0.0)]


def test_of_its_content_an_episode_has_looks_the_most_salient_first() -> None:
    mind = Mind()
    energy = Need(id=need_id("energy"), label="energy", level=0.9, salience=-0.75)
    mind.live((0.0, 0.0), *seen("house", "house~2", "tower"), energy)
    mind.live((0.0, 0.0), *seen("tower", salience=0.5), cycles=2)

    (episode,) = mind.episodes()
    assert episode.content == [
        Remembered(kind="need", label="energy", salience=-0.75),
        Remembered(kind="object", label="tower", salience=0.5),
        Remembered(kind="object", label="house"),
    ]


def test_an_agent_that_is_lost_or_conscious_of_nothing_has_no_episode() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), cycles=3)
    mind.live((3.0, 4.0), *seen("bakery"), cycles=3, is_lost=True)

    assert mind.episodes() == []


def test_what_lasts_longer_is_the_more_active_episode() -> None:
    mind = Mind()
    mind.live((0.0, 0.0), *seen("bakery"), cycles=2)
    mind.live((20.0, 0.0), *seen("bakery"), cycles=12)

    brief, long = of_type(TransientEpisode, mind.episodes())
    assert brief.activation < long.activation


def test_a_place_recalls_what_was_conscious_there_in_an_earlier_run() -> None:
    mind = second_run(first_run())
    mind.live((4.0, 4.5), *seen(*LOOKS), cycles=3)

    (recalled,) = mind.recalled()
    assert (recalled.id, recalled.run, recalled.map) == ("episode:1", 1, ROOT_MAP)
    assert (recalled.x_m, recalled.y_m) == (3.0, 4.0)
    assert [node.label for node in recalled.content] == sorted(LOOKS)
    assert 0.3 < recalled.activation <= 1.0
    assert recalled.salience == pytest.approx(0.5 * recalled.activation)


def test_binary_memory_recalls_an_episode_too() -> None:
    mind = second_run(first_run(), config(sparse=BINARY))
    mind.live((4.0, 4.5), *seen(*LOOKS), cycles=3)

    assert [episode.number for episode in mind.recalled()] == [1]


@pytest.mark.parametrize(
    ("at_m", "looks"), [((200.0, 90.0), LOOKS), ((4.0, 4.5), ("mill", "hall", "farm"))]
)
def test_the_same_elsewhere_and_another_content_recall_nothing(
    at_m: tuple[float, float], looks: tuple[str, ...]
) -> None:
    mind = second_run(first_run())
    mind.live(at_m, *seen(*looks), cycles=3)

    assert mind.recalled() == []


def test_the_same_in_another_town_recalls_nothing() -> None:
    mind = Mind()
    mind.module.feed(Restored(records=first_run()))
    mind.live((4.0, 4.5), *seen(*LOOKS), cycles=4)

    assert {record.map for record in mind.episodes() if record.run == 2} == {"remembered:2"}
    assert mind.recalled() == []


def test_an_episode_is_offered_once_while_the_agent_stays() -> None:
    mind = second_run(first_run())
    mind.live((4.0, 4.5), *seen(*LOOKS), cycles=10)

    assert len(mind.recalled()) == 1


def test_after_an_offer_no_other_is_made_for_the_refractory_period() -> None:
    waiting = msgspec.structs.replace(EPISODIC, refractory_cycles=6)
    mind = second_run(first_run(), config(waiting))
    for cycle in range(12):
        at_m = (4.0, 4.5) if cycle % 2 else (100.0, 0.0)
        mind.live(at_m, *seen(*LOOKS))

    cycles = [offer.cycle for offer in of_type(Offer, mind.published) if offer.operations]
    assert len(cycles) == 2
    assert cycles[1] - cycles[0] > 6


@pytest.mark.parametrize(("away", "recalled"), [(5, []), (40, [1])])
def test_an_episode_of_this_run_is_recalled_once_it_is_long_enough_ago(
    away: int, recalled: list[int]
) -> None:
    mind = Mind(config(msgspec.structs.replace(EPISODIC, recall_after_s=30.0)))
    mind.live((0.0, 0.0), *seen(*LOOKS), cycles=5)
    mind.live((60.0, 0.0), cycles=away)
    mind.live((0.0, 0.0), *seen(*LOOKS), cycles=5)

    assert [episode.number for episode in mind.recalled()] == recalled


def test_an_episode_that_is_conscious_again_is_more_active() -> None:
    mind = Mind()
    mind.live((0.0, 0.0), *seen(*LOOKS), cycles=5)
    mind.live((60.0, 0.0), cycles=3)
    mind.live((0.0, 0.0), *seen(*LOOKS), cycles=3)
    (recalled, *_) = mind.recalled()
    before = of_type(TransientEpisode, mind.episodes())[0].activation

    mind.live((0.0, 0.0), recalled, cycles=3)

    assert of_type(TransientEpisode, mind.episodes())[0].activation > before


def test_the_next_run_keeps_what_was_active_and_forgets_the_rest() -> None:
    mind = second_run(first_run())
    mind.live((200.0, 0.0), *seen("hall"), cycles=3)

    kept = {record.number: record for record in mind.episodes()}
    assert isinstance(kept[1], DeclarativeEpisode)
    assert of_type(Stored, mind.published)[0].forgotten == ["episode/2"]
    assert isinstance(kept[3], TransientEpisode)
    assert kept[3].run == 2


def test_a_restart_continues_the_run_and_consolidates_nothing() -> None:
    before = Mind()
    before.live((3.0, 4.0), *seen(*LOOKS), cycles=20)
    again = Mind()
    assert again.module.restore is not None
    again.module.restore(of_type(Stored, before.published))
    again.module.feed(Restored(records=list(before.records().values())))

    again.cycle = before.cycle
    again.live((60.0, 0.0), *seen("hall"), cycles=3)
    again.live((3.0, 4.0), *seen(*LOOKS), cycles=3)

    assert [(episode.number, episode.run) for episode in again.episodes()] == [(2, 1), (3, 1)]
    assert [episode.number for episode in again.recalled()] == [1]


def test_the_episodes_of_a_run_move_into_the_frame_of_the_map_that_it_recalls() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    mind.live((20.0, 4.0), *seen("hall"), cycles=3)
    mind.commit(_recollection("remembered:7", 100.0, 50.0, np.pi))
    mind.commit(Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:7"))
    mind.live((80.0, 46.0), *seen("hall"), cycles=3)

    moved, second = mind.episodes()
    assert {moved.map, second.map} == {"remembered:7"}
    assert (moved.x_m, moved.y_m) == pytest.approx((97.0, 46.0))
    assert (second.x_m, second.y_m) == pytest.approx((80.0, 46.0))
    assert second.path[0] == pytest.approx((97.0, 46.0))

    mind.live((97.0, 46.0), *seen(*LOOKS), cycles=3)
    assert [(each.x_m, each.y_m) for each in mind.recalled()] == [(moved.x_m, moved.y_m)]


def test_a_correction_of_the_map_moves_episodes_with_the_path_nearest_to_them() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    mind.live((43.0, 4.0), *seen("hall"), cycles=3)
    rows = [[0.2, 3.0, 3.0, 0.0, 5.0, 9.0, np.pi / 2], [0.8, 40.0, 4.0, 0.0, 40.0, 4.0, 0.0]]
    mind.commit(Correction(id=CORRECTION_ID, rows=Matrix.of(rows)))
    path = PathSegment(id=segment_id(0), number=0, rows=Matrix.of(np.zeros((1, len(PathColumn)))))
    mind.commit(DropNode(id=CORRECTION_ID), path, phase=Phase.CORRECTION)
    mind.live((43.0, 4.0), *seen("hall"), cycles=3)

    first, second = mind.episodes()
    assert (first.x_m, first.y_m) == pytest.approx((4.0, 9.0))
    assert (second.x_m, second.y_m) == pytest.approx((43.0, 4.0))
    assert second.path[0] == pytest.approx((4.0, 9.0))

    mind.live((4.0, 9.0), *seen(*LOOKS), cycles=3)
    assert [each.number for each in mind.recalled()] == [first.number]


def test_a_correction_that_is_outdated_moves_no_episode() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    rows = [[0.2, 3.0, 3.0, 0.0, 5.0, 9.0, 0.0]]
    mind.commit(Correction(id=CORRECTION_ID, rows=Matrix.of(rows)))
    mind.commit(DropNode(id=CORRECTION_ID), phase=Phase.CORRECTION)
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)

    (episode,) = mind.episodes()
    assert (episode.x_m, episode.y_m) == (3.0, 4.0)


def test_episodes_of_a_frame_that_nobody_knows_any_more_are_forgotten() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    mind.commit(Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:7"))
    mind.live((80.0, 46.0), *seen("hall"), cycles=3)

    assert [episode.number for episode in mind.episodes()] == [2]


def test_episodes_survive_in_the_database_beside_the_maps_of_an_older_one(tmp_path: Path) -> None:
    records = first_run()
    maps = [each for each in records if not isinstance(each, StoredEpisode)]
    store = Store(tmp_path / "memory.db")
    store.save(Stored(cycle=1, records=maps))
    store.close()

    store = Store(tmp_path / "memory.db")
    assert of_type(StoredObjects, store.restored().records)
    store.save(Stored(cycle=2, records=of_type(TransientEpisode, records)))
    store.close()

    store = Store(tmp_path / "memory.db")
    assert store.restored().records == [*maps, *of_type(TransientEpisode, records)]
    store.close()


def test_the_same_messages_lead_to_the_same_bytes() -> None:
    def published() -> list[bytes]:
        mind = second_run(first_run())
        mind.live((4.0, 4.5), *seen(*LOOKS), cycles=3)
        return [encode(message) for message in mind.published]

    assert published() == published()


def test_in_real_time_an_episode_is_all_that_is_offered() -> None:
    mind = second_run(first_run(), config(mode="real_time"))
    mind.live((4.0, 4.5), *seen(*LOOKS), cycles=6)

    assert len(of_type(Offer, mind.published)) == 1


def _recollection(name: str, x_m: float, y_m: float, heading_rad: float) -> Recollection:
    return Recollection(
        id=RECOLLECTION_ID,
        map=name,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        labels=["mill"],
        functions=[""],
        matched=["mill"],
        objects=Matrix.of(np.ones((1, 7))),
    )
