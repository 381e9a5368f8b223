"""Episodes as the module stores and recalls them: what was conscious, where and when."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from cogmap.bus.codec import encode
from cogmap.runtime.run import REAL_TIME
from cogmap.runtime.state.store import Store
from cogmap.schemas.codelets import Offer
from cogmap.schemas.memory import (
    DeclarativeEpisode,
    Restored,
    Stored,
    StoredEpisode,
    StoredObjects,
    TransientEpisode,
)
from cogmap.schemas.nodes import (
    ROOT_MAP,
    Need,
    Remembered,
    need_id,
)
from cogmap.testing import of_type
from tests.support.world.mind import (
    BINARY,
    EPISODIC,
    LOOKS,
    Mind,
    S,
    config,
    first_run,
    second_run,
    seen,
)


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
    mind.live((0.0, 0.0), *seen("house", "house", "tower"), energy)
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
    mind = second_run(first_run(), run=REAL_TIME)
    mind.live((4.0, 4.5), *seen(*LOOKS), cycles=6)

    assert len(of_type(Offer, mind.published)) == 1
