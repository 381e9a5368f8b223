"""Recall of episodes from a part of their content, near the place at which they were.

A town has buildings of few looks, so that most episodes share content with many others. A cue has
two thirds of the content of one, something else in the place of the rest, and a position that is
some metres beside it.
"""

from __future__ import annotations

import msgspec
import numpy as np

from benchmarks.report import Metrics
from cogmap.schemas.memory import TransientEpisode
from cogmap.schemas.nodes import Remembered
from cogmap.services.memory.public import EpisodicConfig, SparseConfig, cues, episodic_memory

CUES = 200
LOOKS = 20
CONTENT = (3, 10)
REPLACED = 1 / 3
TOWN_M = 600.0
BESIDE_M = 3.0
PATH = 3


def measure(seed: int) -> Metrics:
    """Return the share of cues that recall their own episode, and of those that recall another,
    among as many episodes as Declarative Memory may hold; a match must be good enough to be
    offered.
    """
    config = EpisodicConfig()
    rng = np.random.default_rng(seed)
    episodes = _episodes(config.max_declarative, rng)
    memory = cues.EpisodicCues(SparseConfig(seed=seed))
    for _ in range(0, len(episodes), cues.MAX_LEARNED):
        memory.hold(episodes)

    right = 0
    wrong = 0
    for number in rng.choice(sorted(episodes), CUES, replace=False).tolist():
        episode = episodes[number]
        beside_m = rng.normal(0.0, BESIDE_M, 2).tolist()
        replaced = round(REPLACED * len(episode.content))
        others = rng.choice(LOOKS, replaced, replace=False).tolist()
        content = [*episode.content[replaced:], *(_object(look) for look in others)]
        cue = msgspec.structs.replace(
            episode, x_m=episode.x_m + beside_m[0], y_m=episode.y_m + beside_m[1], content=content
        )

        found = memory.recalled(cue, lambda _: True)
        if found is not None and found.match >= episodic_memory.MIN_MATCH:
            right += found.number == number
            wrong += found.number != number

    return {"episodes_recalled": right / CUES, "wrong_episodes": wrong / CUES}


def _episodes(count: int, rng: np.random.Generator) -> dict[int, TransientEpisode]:
    """Draw episodes at random places of a town, by number."""
    episodes = {}
    path: list[tuple[float, float]] = []
    for number in range(1, 1 + count):
        x_m, y_m = rng.uniform(0.0, TOWN_M, 2).tolist()
        number_here = rng.integers(*CONTENT, endpoint=True)
        looks = rng.choice(LOOKS, number_here, replace=False).tolist()
        episodes[number] = TransientEpisode(
            number=number,
            run=1,
            map="town",
            x_m=x_m,
            y_m=y_m,
            from_ns=0,
            until_ns=0,
            content=[_object(look) for look in looks],
            path=path,
            activation=0.5,
            active_ns=0,
        )
        path = [(x_m, y_m), *path][:PATH]

    return episodes


def _object(look: int) -> Remembered:
    return Remembered(kind="object", label=f"look {look}")
