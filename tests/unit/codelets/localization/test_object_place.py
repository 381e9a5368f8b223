"""Nodes of objects that are seen for the first time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import Object, object_id
from cogmap.services.codelets.config import Config
from cogmap.testing import agent, graph_of, percept, task
from tests.support.world.scenes import Desk, run

CONFIG = Config(landmark_samples=40)


def test_a_new_object_gets_a_node_with_samples_where_it_is_seen() -> None:
    facing_north = (3.0, 4.0, math.pi / 2)
    graph = graph_of(agent(np.tile(facing_north, (50, 1))))
    seen = percept("house", math.pi / 2, 10.0, range_sd_m=0.5, bearing_sd_rad=0.01, width_m=7.0)
    found, link = run(task("object_place", percepts=[seen]), graph, CONFIG).operations

    assert isinstance(found, Object)
    assert (found.id, found.label) == ("object:house", "house")
    assert (found.x_m, found.y_m) == pytest.approx((-7.0, 4.0), abs=0.3)
    assert found.x_sd_m == pytest.approx(0.5, rel=0.35)
    assert found.width_m == 7.0
    assert found.positions_m().shape == (CONFIG.landmark_samples, 2)
    assert link == Link(source="object:house", target="place:map:0:-7:4")


def test_an_unsure_heading_spreads_a_far_object_across_the_line_of_sight() -> None:
    samples = np.zeros((500, 3))
    samples[:, 2] = np.random.default_rng(1).normal(0.0, 0.1, 500)
    seen = percept("house", 0.0, 30.0, range_sd_m=0.2, bearing_sd_rad=0.001)
    asked = task("object_place", percepts=[seen])
    config = Config(landmark_samples=2000)
    found, _ = run(asked, graph_of(agent(samples)), config).operations

    assert isinstance(found, Object)
    assert found.y_sd_m == pytest.approx(3.0, rel=0.1)
    assert found.x_sd_m < 0.5


def _drives_on_after(views: int) -> Object | None:
    """What the map has of a house that was seen in so many views, 30 views later."""
    desk = Desk("w1")
    for frame in range(views + 30):
        in_view = [percept("house", 0.0, 10.0)] if frame < views else []
        desk.see(frame, *in_view)
        desk.work()

    return desk.graph.get(Object, object_id("house"))


def test_what_was_seen_in_one_view_alone_is_forgotten_soon() -> None:
    assert _drives_on_after(views=1) is None


def test_what_a_second_view_confirmed_is_remembered() -> None:
    found = _drives_on_after(views=2)

    assert found is not None
    assert found.sightings == 2
