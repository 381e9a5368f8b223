"""The frame of the agent's map, before and after it has recalled one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.evaluation.paths import Paths
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Delta, Operation, Phase
from cogmap.schemas.nodes import RECOLLECTION_ID, ROOT_MAP, Map, Recollection
from cogmap.schemas.sensing import Pose, TruePose
from cogmap.testing import agent

START = Pose(x_m=10.0, y_m=20.0, heading_rad=math.pi / 2)


def delta(version: int, *operations: Operation) -> Delta:
    """A commit."""
    return Delta(
        stamp_ns=version,
        version=version,
        cycle=version,
        phase=Phase.LOCALIZATION,
        operations=list(operations),
    )


def joined() -> Paths:
    """One that has seen the agent drive 4 m ahead, recall a map on which it so stands at (104, 0),
    with the same heading, and drive another metre.
    """
    recollection = Recollection(
        id=RECOLLECTION_ID,
        map="remembered:1",
        x_m=100.0,
        y_m=0.0,
        heading_rad=0.0,
        labels=["12a"],
        names=["house"],
        given_names=[""],
        functions=[""],
        matched=[""],
        objects=Matrix.of(np.zeros((1, 7))),
    )
    paths = Paths()
    paths.update(TruePose(stamp_ns=1, pose=START, travelled_m=4.0, progress=0.0))
    paths.update(delta(1, agent(x_m=4.0, stamp_ns=1)))
    paths.update(delta(2, recollection))
    paths.update(delta(3, Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:1")))
    paths.update(delta(4, agent(x_m=105.0, stamp_ns=4)))
    return paths


def test_before_a_map_is_recalled_the_frame_is_that_of_the_start() -> None:
    paths = Paths()
    paths.update(TruePose(pose=START, travelled_m=0.0, progress=0.0))

    assert paths.map_frame == START
    assert paths.recalled == ""


def test_the_path_goes_on_where_it_was_when_a_map_is_recalled() -> None:
    assert joined().estimated_path_m == pytest.approx(np.array([[10.0, 24.0], [10.0, 25.0]]))


def test_the_map_lies_where_it_was_learned() -> None:
    paths = joined()

    frame = paths.map_frame
    assert frame is not None
    assert (frame.x_m, frame.y_m) == pytest.approx((10.0, -80.0))
    assert paths.to_world(np.array([[100.0, 0.0]])) == pytest.approx(np.array([[10.0, 20.0]]))


def test_it_is_told_which_map_was_recalled() -> None:
    assert joined().recalled == "remembered:1"


def test_what_is_transformed_to_the_map_and_back_is_where_it_was() -> None:
    paths = joined()
    points_m = np.array([[3.0, -7.0], [10.0, 20.0]])

    assert paths.to_map(points_m)[1] == pytest.approx((100.0, 0.0))
    assert paths.to_world(paths.to_map(points_m)) == pytest.approx(points_m)
