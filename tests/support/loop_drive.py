"""A drive round a block of which one side seems longer than it is, for tests of map correction."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from schemas.sensing import Percept, PlaceMatch
from services.codelets.module import Config as WorkerConfig
from tests.support.scenes import Desk, motion, percept, percepts, stamp_ns

STEP_M = 2.0
SIDE_STEPS = 20
LAP = 4 * SIDE_STEPS
QUIET = WorkerConfig(
    samples=60,
    kept_samples=30,
    landmark_samples=40,
    largest_landmark_sd_m=1e-6,
    correct="positions",
    path_variance_per_m=0.01,
    heading_variance_per_m=1e-4,
    heading_variance_per_rad=2e-3,
    revisit_s=5.0,
    closure_spacing_s=0.2,
)
SLIP = 0.1


def true_poses(frames: int) -> np.ndarray:
    """(frames, 3): where the robot is at each view, counter-clockwise round a square."""
    poses = [np.zeros(3)]
    for number in range(1, frames):
        x_m, y_m, heading = poses[-1]
        heading += math.pi / 2 if number % SIDE_STEPS == 0 else 0.0
        poses.append(
            np.array([x_m + STEP_M * math.cos(heading), y_m + STEP_M * math.sin(heading), heading])
        )
    return np.array(poses)


def seen(pose: np.ndarray, label: str, where: tuple[float, float]) -> Percept:
    """A landmark as seen without error."""
    off = np.array(where) - pose[:2]
    bearing = math.remainder(math.atan2(off[1], off[0]) - pose[2], 2 * math.pi)
    return percept(label, bearing, float(np.hypot(*off)), bearing_sd_rad=0.01, range_sd_m=0.2)


class LoopDrive:
    """The mind alone on that drive: percepts made up, a workspace, and real workers."""

    def __init__(
        self,
        worker: WorkerConfig = QUIET,
        workers: int = 1,
        mode: str = "lockstep",
        bias_rad: float = 0.0,
        **settings: object,
    ):
        names = [f"w{number}" for number in range(workers)]
        self.desk = Desk(*names, mode=mode, codelets=worker, **settings)
        self.bias_rad = bias_rad
        self.poses = true_poses(3 * LAP)
        self.frame = 0

    def go(
        self, frames: int, landmarks: dict[str, tuple[float, float]], match: int | None = None
    ) -> None:
        """Drive on, seeing `landmarks`; the last view matches that of frame `match`."""
        for left in range(frames, 0, -1):
            turned = (
                0.0
                if self.frame == 0
                else float(self.poses[self.frame, 2] - self.poses[self.frame - 1, 2])
            )
            # Turning first, then straight on: two rows.
            turn_row = (0.0, (turned + self.bias_rad) / 0.1, 0.1, 0.0, 0.0)
            slip = SLIP if self.frame // SIDE_STEPS % 4 == 1 else 0.0
            step_m = STEP_M * (1 + slip) if self.frame else 0.0
            rows = (turn_row, (step_m / 0.1, 0.0, 0.1, 0.0, 0.0))
            self.desk.feed(motion(self.frame, rows))
            objects = [
                seen(self.poses[self.frame], label, where) for label, where in landmarks.items()
            ]
            view = percepts(self.frame, *objects, road_m=((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
            if match is not None and left == 1:
                seen_again = PlaceMatch(frame=match, view_ns=stamp_ns(match), score=0.99)
                view = msgspec.structs.replace(view, matches=[seen_again])
            self.desk.feed(view)
            self.desk.work()
            self.frame += 1

    def meet(
        self, frames: int, landmarks: dict[str, tuple[float, float]] | None = None, late: int = 0
    ) -> None:
        """Drive on where the robot has been a lap ago, and see `landmarks` again, or else match the
        views of then.

        Those that match are `late` views later than they should be.
        """
        for _ in range(frames):
            self.go(1, landmarks or {}, match=None if landmarks else self.frame - LAP + late)

    def error_m(self) -> float:
        """How far the agent takes itself to be from where it is."""
        agent = self.desk.agent
        where = self.poses[self.frame - 1]
        return math.hypot(agent.x_m - where[0], agent.y_m - where[1])
