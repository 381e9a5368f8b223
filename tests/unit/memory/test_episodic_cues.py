"""Episodes as vectors, and which of many a cue recalls."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from cogmap.schemas.memory import TransientEpisode
from cogmap.schemas.nodes import Remembered
from cogmap.services.memory.episodic.cues import MAX_LEARNED, EpisodicCues, Found
from cogmap.services.memory.sparse.config import SparseConfig

SMALL = SparseConfig(hard_locations=2000, dimensions=512)
LOOKS = [f"look {number}" for number in range(20)]
PATH = ((5.0, 5.0), (-5.0, 5.0))


def episode(
    number: int = 1,
    at_m: tuple[float, float] = (10.0, 10.0),
    looks: Iterable[str] = LOOKS[:6],
    path: Iterable[tuple[float, float]] = PATH,
    name: str = "town",
) -> TransientEpisode:
    """Objects of those looks at a place."""
    x_m, y_m = at_m
    return TransientEpisode(
        number=number,
        run=1,
        map=name,
        x_m=x_m,
        y_m=y_m,
        from_ns=0,
        until_ns=0,
        content=[Remembered(kind="object", label=look) for look in looks],
        path=list(path),
        activation=0.5,
        active_ns=0,
    )


def match(cue: TransientEpisode, stored: TransientEpisode | None = None) -> float:
    """How well a cue matches the one episode that is stored; 0 where it recalls none."""
    cues = EpisodicCues(SMALL)
    cues.hold({1: stored or episode()})
    found = cues.recalled(cue, lambda _: True)
    return 0.0 if found is None else found.match


def town(count: int) -> dict[int, TransientEpisode]:
    """Episodes at random places of a town of 600 m with buildings of twenty looks."""
    rng = np.random.default_rng(4)
    found = {}
    path: list[tuple[float, float]] = []
    for number in range(1, 1 + count):
        x_m, y_m = rng.uniform(-300, 300, 2).tolist()
        looks = [LOOKS[index] for index in rng.choice(20, 6, replace=False).tolist()]
        found[number] = episode(number, (x_m, y_m), looks, path)
        path = [(x_m, y_m), *path][:3]

    return found


def test_the_same_episode_matches_wholly() -> None:
    assert match(episode()) == 1.0


def test_the_match_falls_with_each_thing_that_differs() -> None:
    matches = [match(episode(looks=LOOKS[first : first + 6])) for first in range(7)]

    assert matches == sorted(matches, reverse=True)
    assert matches[-1] < 0.3 < matches[3]


def test_who_comes_the_same_way_is_reminded_more() -> None:
    other_way = [(25.0, 15.0), (35.0, 15.0)]
    backwards = [(-5.0, 5.0), (5.0, 5.0)]

    assert match(episode(looks=LOOKS[2:8])) > match(episode(looks=LOOKS[2:8], path=other_way))
    assert match(episode(looks=LOOKS[2:8])) > match(episode(looks=LOOKS[2:8], path=backwards))


@pytest.mark.parametrize(
    ("at_m", "is_here"),
    [((12.0, 8.0), True), ((23.0, 10.0), True), ((23.0, 23.0), True), ((26.0, 10.0), False)],
)
def test_a_cue_within_half_a_place_of_the_cell_finds_the_episode(
    at_m: tuple[float, float], is_here: bool
) -> None:
    assert (match(episode(at_m=at_m)) > 0.3) == is_here


def test_the_same_on_another_map_is_unrelated() -> None:
    assert match(episode(name="another town")) < 0.1


def test_of_many_episodes_that_share_looks_the_right_one_is_recalled() -> None:
    episodes = town(MAX_LEARNED)
    cues = EpisodicCues(SMALL)
    cues.hold(episodes)

    right = 0
    for number, stored in episodes.items():
        looks = [node.label for node in stored.content[:4]]
        cue = episode(0, (stored.x_m + 2.0, stored.y_m - 2.0), looks, stored.path)
        found = cues.recalled(cue, lambda _: True)
        right += found is not None and found.number == number

    assert right >= 0.95 * len(episodes)


def test_what_is_not_held_any_more_or_not_wanted_is_not_recalled() -> None:
    cues = EpisodicCues(SMALL)
    cues.hold({1: episode(1), 2: episode(2, (100.0, 50.0))})
    assert cues.recalled(episode(), lambda number: number != 1) is None

    cues.hold({2: episode(2, (100.0, 50.0))})
    assert cues.recalled(episode(), lambda _: True) is None
    assert cues.recalled(episode(at_m=(100.0, 50.0)), lambda _: True) == Found(2, 1.0)


def test_many_restored_episodes_are_learned_in_several_steps() -> None:
    episodes = town(MAX_LEARNED + 1)
    cues = EpisodicCues(SMALL)
    last = episodes[MAX_LEARNED + 1]

    cues.hold(episodes)
    before = cues.recalled(last, lambda number: number == last.number)
    cues.hold(episodes)

    assert before is None
    assert cues.recalled(last, lambda _: True) == Found(last.number, 1.0)


def test_an_empty_memory_recalls_nothing() -> None:
    assert EpisodicCues(SMALL).recalled(episode(), lambda _: True) is None
