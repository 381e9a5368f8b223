"""An episode that was recalled just now is brought forward once."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Decay, Delta, Phase
from cogmap.schemas.nodes import Episode, Remembered, episode_id
from cogmap.services.codelets.attention import episode
from cogmap.testing import agent, graph_of, percepts, task
from tests.support.world.scenes import run

CONFIG = NoSettings()
BAKERY = Remembered(kind="object", label="bakery")


def _recalled(number: int, activation: float = 0.5, salience: float = 0.0) -> Episode:
    return Episode(
        id=episode_id(number),
        activation=activation,
        cycle=1,
        salience=salience,
        number=number,
        run=1,
        x_m=1.0,
        y_m=2.0,
        from_ns=0,
        until_ns=10**9,
        content=[BAKERY],
    )


def _due(graph: Graph, cycle: int = 1) -> bool:
    return bool(episode.due(CycleContext(cycle, percepts(cycle), NO_MOTION), graph, CONFIG))


NO_MOTION = Array.of(np.zeros((0, 5)))


def test_without_a_recalled_episode_nothing_is_brought() -> None:
    graph = graph_of(agent())

    assert not _due(graph)
    assert run(task("episode"), graph, CONFIG).coalitions == []


def test_the_agent_and_the_episode_that_matches_best_are_brought() -> None:
    graph = graph_of(agent(), _recalled(3, 0.4), _recalled(7, 0.6))

    assert _due(graph)
    (found,) = run(task("episode"), graph, CONFIG).coalitions
    assert [node.id for node in found.nodes] == ["self", "episode:7"]


@pytest.mark.parametrize("salience", [-0.5, 0.5])
def test_what_was_felt_then_makes_an_episode_more_active(salience: float) -> None:
    (neutral,) = run(task("episode"), graph_of(agent(), _recalled(1)), CONFIG).coalitions
    (felt,) = run(
        task("episode"), graph_of(agent(), _recalled(1, salience=salience)), CONFIG
    ).coalitions

    assert felt.activation > neutral.activation


def test_an_episode_that_has_decayed_is_not_brought_again() -> None:
    decay = Decay(activation=0.1, base_level=0.0, place_activation=0.0, forget_below=0.0)
    graph = graph_of(agent(), _recalled(1), decay)
    assert graph.apply(Delta(version=2, cycle=12, phase=Phase.PERCEPTS, operations=[]))

    assert not _due(graph, 12)
