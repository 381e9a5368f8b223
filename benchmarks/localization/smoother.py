"""What mapping is held against: a batch smoother of gtsam's, which sees the whole log at once."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.localization.senses import Moment
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

gtsam: Any
try:
    gtsam = importlib.import_module("gtsam")
except ImportError:
    gtsam = None

STEPS = 100
LEAST_SD = 1e-4
SIDEWAYS_SHARE = 0.2
CAUCHY = 2.0


def check_installed() -> None:
    """Raise UsageError where gtsam is not installed."""
    if gtsam is None:
        raise UsageError(
            "gtsam is not installed, and this benchmark measures against it: run make bench-setup"
        )


def smooth(moments: list[Moment]) -> Floats:
    """(n, 3) poses at the moments that fit all percepts and motions best, landmarks unknown, the
    start at 0.

    Levenberg-Marquardt on the same percepts, motions and noise that the codelets get; Cauchy's
    weights, so that a landmark taken for another does not count for much.
    """
    graph = gtsam.NonlinearFactorGraph()
    start = gtsam.Values()
    pose = gtsam.Pose2(0.0, 0.0, 0.0)
    start.insert(_pose(0), pose)
    graph.add(gtsam.PriorFactorPose2(_pose(0), pose, gtsam.noiseModel.Constrained.All(3)))
    for index, moment in enumerate(moments, 1):
        way, sd = _step(moment.motions)
        noise = gtsam.noiseModel.Diagonal.Sigmas(sd)
        graph.add(
            gtsam.BetweenFactorPose2(_pose(index - 1), _pose(index), gtsam.Pose2(*way), noise)
        )
        pose = pose.compose(gtsam.Pose2(*way))
        start.insert(_pose(index), pose)
        _add_percepts(graph, start, index, pose, moment)
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(STEPS)
    found = gtsam.LevenbergMarquardtOptimizer(graph, start, parameters).optimize()
    poses = [found.atPose2(_pose(index)) for index in range(1, len(moments) + 1)]
    return np.array([(each.x(), each.y(), each.theta()) for each in poses])


def _pose(index: int) -> int:
    key: int = gtsam.symbol("x", index)
    return key


def _add_percepts(graph: Any, start: Any, index: int, pose: Any, moment: Moment) -> None:
    robust = gtsam.noiseModel.mEstimator.Cauchy.Create(CAUCHY)
    for percept in moment.percepts:
        landmark = gtsam.symbol("l", int(percept.label.rpartition("-")[2]))
        sd = gtsam.noiseModel.Diagonal.Sigmas(
            np.array([percept.bearing_sd_rad, percept.range_sd_m])
        )
        bearing = gtsam.Rot2(percept.bearing_rad)
        noise = gtsam.noiseModel.Robust.Create(robust, sd)
        graph.add(
            gtsam.BearingRangeFactor2D(_pose(index), landmark, bearing, percept.range_m, noise)
        )
        if not start.exists(landmark):
            ahead = percept.range_m * np.array(
                [np.cos(percept.bearing_rad), np.sin(percept.bearing_rad)]
            )
            start.insert(landmark, pose.transformFrom(ahead))


def _step(rows: Floats) -> tuple[Floats, Floats]:
    """The pose that (n, 5) rows of motion lead to from 0, and its standard deviations."""
    speed, turn_rate, dt, speed_sd, turn_rate_sd = rows.T
    turn = turn_rate * dt
    heading = np.cumsum(turn) - turn / 2
    way_sd = float(np.sqrt(np.square(speed_sd * dt).sum()))
    turn_sd = float(np.sqrt(np.square(turn_rate_sd * dt).sum()))
    way = np.array(
        [(speed * dt * np.cos(heading)).sum(), (speed * dt * np.sin(heading)).sum(), turn.sum()]
    )
    return way, np.array([way_sd, SIDEWAYS_SHARE * way_sd, turn_sd]) + LEAST_SD
