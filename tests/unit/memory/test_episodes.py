"""What decays in Transient Episodic Memory, and what is consolidated to Declarative Memory."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.schemas.memory import DeclarativeEpisode, TransientEpisode
from cogmap.schemas.nodes import Remembered
from cogmap.services.memory.episodic.config import EpisodicConfig
from cogmap.services.memory.episodic.episodes import HOUR_NS, MAX_TRANSIENT, Episodes

BAKERY = Remembered(kind="object", label="bakery")
CONFIG = EpisodicConfig(decay_per_h=0.1, consolidation_h=1.0, max_declarative=2)


def transient(number: int = 1, activation: float = 0.8, run: int = 1) -> TransientEpisode:
    """An episode that ended at 0 s."""
    return TransientEpisode(
        number=number,
        run=run,
        map="remembered:1",
        x_m=1.0,
        y_m=2.0,
        from_ns=0,
        until_ns=0,
        content=[BAKERY],
        activation=activation,
        active_ns=0,
    )


def known(*episodes: TransientEpisode) -> Episodes:
    """Memories that hold these, all stored."""
    memories = Episodes(CONFIG)
    memories.restore(episodes)
    return memories


def after(hours: float, episode: TransientEpisode) -> list[str]:
    """In which memories an episode of this run is so long after it ended."""
    memories = known(episode)
    memories.consolidate(1, round(hours * HOUR_NS))
    return [type(found).__name__ for found in memories.known.values()]


@pytest.mark.parametrize(
    ("activation", "hours", "found"),
    [
        (0.8, 0.9, ["TransientEpisode"]),
        (0.8, 1.0, ["DeclarativeEpisode"]),
        (0.69, 1.0, ["TransientEpisode"]),
        (0.69, 6.8, ["TransientEpisode"]),
        (0.69, 7.0, []),
    ],
)
def test_what_is_active_after_an_hour_is_kept_and_the_rest_decays(
    activation: float, hours: float, found: list[str]
) -> None:
    assert after(hours, transient(activation=activation)) == found


def test_a_consolidated_episode_replaces_its_record_and_does_not_decay() -> None:
    memories = known(transient())
    memories.consolidate(1, HOUR_NS)
    ((record,), forgotten) = memories.take_changes()

    assert isinstance(record, DeclarativeEpisode)
    assert (record.key, record.content, forgotten) == (transient().key, [BAKERY], [])

    memories.consolidate(1, 1000 * HOUR_NS)
    assert memories.known == {1: record}
    assert memories.take_changes() == ([], [])


def test_between_runs_no_time_is_counted_and_nothing_stays_transient() -> None:
    memories = known(transient(1, 0.8), transient(2, 0.5))
    memories.consolidate(2, 100 * HOUR_NS)

    records, forgotten = memories.take_changes()
    assert [type(record) for record in records] == [DeclarativeEpisode]
    assert forgotten == ["episode/2"]


def test_an_episode_decays_until_its_run_ended() -> None:
    last = msgspec.structs.replace(transient(2), from_ns=5 * HOUR_NS, until_ns=5 * HOUR_NS)
    last = msgspec.structs.replace(last, active_ns=5 * HOUR_NS)
    memories = known(transient(1), last)
    memories.consolidate(2, 0)

    assert list(memories.known) == [2]


def test_an_episode_that_is_conscious_again_lasts_longer() -> None:
    memories = known(transient(activation=0.69))
    memories.reinforce(1, 0.2, HOUR_NS // 2)
    memories.consolidate(1, HOUR_NS)

    assert isinstance(memories.known[1], DeclarativeEpisode)


def test_declarative_memory_forgets_its_oldest_episodes_where_it_is_full() -> None:
    memories = known(transient(1), transient(2), transient(3))
    memories.consolidate(1, HOUR_NS)

    assert sorted(memories.known) == [2, 3]
    assert memories.take_changes().forgotten == ["episode/1"]


def test_transient_memory_forgets_its_weakest_episodes_where_it_is_full() -> None:
    strong = [transient(number) for number in range(1, MAX_TRANSIENT)]
    weak = [transient(number, 0.5) for number in range(MAX_TRANSIENT, MAX_TRANSIENT + 3)]
    memories = known(*strong, *weak)
    memories.consolidate(1, 0)

    newest_weak = weak[-1].number
    assert sorted(memories.known) == [*range(1, MAX_TRANSIENT), newest_weak]


def test_an_episode_that_is_put_again_before_it_was_stored_is_not_forgotten() -> None:
    memories = known(transient())
    memories.forget(1)
    memories.put(transient())

    assert memories.take_changes() == ([transient()], [])


def test_a_number_is_not_given_again_once_its_episode_is_forgotten() -> None:
    memories = known(transient(7))
    memories.forget(7)

    assert memories.next_number() == 8


@pytest.mark.parametrize(("moved_m", "learned_anew"), [(0.01, set()), (500.0, {1})])
def test_an_episode_that_moved_within_its_square_is_stored_but_not_learned_anew(
    moved_m: float, learned_anew: set[int]
) -> None:
    memories = known(transient())
    relocated = memories.relocate(
        lambda episode: msgspec.structs.replace(episode, x_m=episode.x_m + moved_m)
    )

    ((record,), _) = memories.take_changes()
    assert relocated == learned_anew
    assert isinstance(record, TransientEpisode)
    assert record.x_m == 1.0 + moved_m
