"""Whether the constants of a robot's senses were fitted to the robots that they are measured on:
each robot localizes by those that the others would choose.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.localization.drives import SEEDS, follow
from benchmarks.localization.loop import DRIFT_RAD_PER_M, RANGE, SPEED, TURN
from benchmarks.localization.senses import moments
from benchmarks.localization.truth import Truth
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.data.mrclam import Recording, Robot
from cogmap.geometry.arrays import Floats

(SEED, *_) = SEEDS
KEY = "left_out_known_map_rmse_m"
THRESHOLDS = {KEY: at_most(0.14)}
CONSTANTS = {
    "speed_gain_sd": SPEED,
    "turn_gain_sd": TURN,
    "drift_rad_per_m": DRIFT_RAD_PER_M,
    "range_gain_sd": RANGE,
}
FACTORS = {"halved": 0.5, "doubled": 2.0}
Candidate = tuple[str, dict[str, float]]


def candidates() -> list[Candidate]:
    """Return the settings that are chosen from, by name: ours, and each constant halved and
    doubled.
    """
    found: list[Candidate] = [("ours", {})]
    for constant, value in CONSTANTS.items():
        for word, factor in FACTORS.items():
            found.append((f"{constant}_{word}", {constant: factor * value}))
    return found


def jobs(recording: Recording) -> list[tuple[Robot, Candidate]]:
    """Return every robot with every candidate but ours, whose error is known, robot by robot."""
    _, *others = candidates()
    return [(robot, candidate) for robot in recording.robots for candidate in others]


def evaluate_candidate(
    job: tuple[Robot, Candidate], landmarks: dict[int, tuple[float, float]]
) -> float:
    """Return a robot's root mean square error in metres on the known map, with a candidate."""
    robot, (_, settings) = job
    log = list(moments(robot))
    truth = Truth.at(robot, np.array([moment.stamp_s for moment in log]))
    x_m, y_m, heading_rad = Truth.at(robot, robot.odometry[:1, 0]).poses[0].tolist()
    drive = follow(log, landmarks, (x_m, y_m, heading_rad), SEED, settings=settings)
    return truth.rmse_m(drive.online)


def summary(ours_m: Sequence[float], errors_m: Sequence[float]) -> Metrics:
    """Return the metrics of the errors with our constants, one a robot, and of the jobs' errors:
    what the candidates chosen on the other robots give on each, and how the mean over the robots
    moves with each constant.
    """
    names = [name for name, _ in candidates()]
    of_others_m = np.array(errors_m).reshape(len(ours_m), -1)
    by_robot: Floats = np.column_stack([ours_m, of_others_m])
    metrics: Metrics = {KEY: left_out_error_m(by_robot)}

    means_m = by_robot.mean(axis=0)
    for name, mean_m in zip(names[1:], means_m[1:], strict=True):
        metrics[f"known_map_{name}_over_ours"] = float(mean_m / means_m[0])
    return metrics


def left_out_error_m(by_robot: Floats) -> float:
    """Return the mean error over the robots, each with the candidate that errs least on the others.

    `by_robot` is (robots, candidates).
    """
    others = by_robot.sum(axis=0) - by_robot
    chosen = others.argmin(axis=1)
    robots = np.arange(len(by_robot))
    return float(by_robot[robots, chosen].mean())
