"""A drive round a block of which one side seems longer than it is, for tests of map correction."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from cogmap.runtime.run import LOCKSTEP, Run
from cogmap.schemas.sensing import Percept, Percepts, PlaceMatch
from cogmap.services.codelets.module import Config as WorkerConfig
from cogmap.testing import Rows, percept_at, percepts, self_motion, stamp_ns
from tests.support.world.scenes import Desk

STEP_M = 2.0
SIDE_STEPS = 20
LAP = 4 * SIDE_STEPS
QUIET = WorkerConfig(
    samples=60,
    kept_samples=30,
    landmark_samples=40,
    correct="positions",
    path_variance_per_m=0.01,
    heading_variance_per_m=1e-4,
    heading_variance_per_rad=2e-3,
    revisit_s=5.0,
    closure_spacing_s=0.2,
)
SLIP = 0.1
TOWER = {"tower": (8.0, 5.0)}
HOUSE = {"house": (40.0, 50.0)}
ROW_S = 0.1
ROAD_M = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
Position = tuple[float, float]
Landmarks = dict[str, Position]


def true_poses(frames: int) -> np.ndarray:
    """(frames, 3): where the robot is at each view, counter-clockwise round a square."""
    poses = np.zeros((frames, 3))
    for number in range(1, frames):
        x_m, y_m, heading = poses[number - 1]
        if number % SIDE_STEPS == 0:
            heading += math.pi / 2
        x_m += STEP_M * math.cos(heading)
        y_m += STEP_M * math.sin(heading)
        poses[number] = x_m, y_m, heading
    return poses


def seen(pose: np.ndarray, label: str, position_m: Position, range_sd_m: float = 0.2) -> Percept:
    """A landmark as seen without error."""
    return percept_at(pose, label, position_m, bearing_sd_rad=0.01, range_sd_m=range_sd_m)


class LoopDrive:
    """The mind alone on that drive: percepts made up, a workspace, and real workers.

    Landmarks have ranges of `range_sd_m`; `beside` is seen in every view.
    """

    def __init__(
        self,
        worker: WorkerConfig = QUIET,
        workers: int = 1,
        run: Run = LOCKSTEP,
        *,
        bias_rad: float = 0.0,
        range_sd_m: float = 0.2,
        beside: tuple[Percept, ...] = (),
        **settings: object,
    ):
        names = [f"w{number}" for number in range(workers)]
        self.desk = Desk(*names, run=run, codelets=worker, **settings)
        self.bias_rad = bias_rad
        self.range_sd_m = range_sd_m
        self.beside = beside
        self.poses = true_poses(3 * LAP)
        self.frame = 0

    def go(self, frames: int, landmarks: Landmarks, match: int | None = None) -> None:
        """Drive on, seeing `landmarks`; the last view matches that of frame `match`."""
        for left in range(frames, 0, -1):
            view = self._view(landmarks)
            if match is not None and left == 1:
                seen_again = PlaceMatch(frame=match, view_ns=stamp_ns(match), score=0.99)
                view = msgspec.structs.replace(view, matches=[seen_again])

            self.desk.feed(self_motion(self.frame, self._rows()))
            self.desk.feed(view)
            self.desk.work()
            self.frame += 1

    def meet(self, frames: int, landmarks: Landmarks | None = None, late: int = 0) -> None:
        """Drive on where the robot has been a lap ago, and see `landmarks` again, or else match the
        views of then.

        Those that match are `late` views later than they should be.
        """
        for _ in range(frames):
            if landmarks:
                self.go(1, landmarks)
            else:
                self.go(1, {}, match=self.frame - LAP + late)

    def error_m(self) -> float:
        """The distance between the agent's estimate and where it is."""
        agent = self.desk.agent
        x_m, y_m, _ = self.poses[self.frame - 1]
        return math.hypot(agent.x_m - x_m, agent.y_m - y_m)

    def _rows(self) -> Rows:
        """The motion as the wheels state it: turning first, then straight on."""
        if self.frame == 0:
            return (self._turn_row(0.0), (0.0, 0.0, ROW_S, 0.0, 0.0))

        before, now = self.poses[self.frame - 1 : self.frame + 1, 2]
        turn_row = self._turn_row(float(now - before))

        side = self.frame // SIDE_STEPS % 4
        slip = SLIP if side == 1 else 0.0
        step_m = STEP_M * (1 + slip)
        return (turn_row, (step_m / ROW_S, 0.0, ROW_S, 0.0, 0.0))

    def _turn_row(self, turned_rad: float) -> tuple[float, ...]:
        return (0.0, (turned_rad + self.bias_rad) / ROW_S, ROW_S, 0.0, 0.0)

    def _view(self, landmarks: Landmarks) -> Percepts:
        """The landmarks and the road, seen without error."""
        pose = self.poses[self.frame]
        objects = [seen(pose, *each, self.range_sd_m) for each in landmarks.items()]
        return percepts(self.frame, *self.beside, *objects, road_m=ROAD_M)


def round_once(drive: LoopDrive) -> LoopDrive:
    """Drive round the block, past a tower at its start and a house on its far side."""
    drive.go(3, TOWER)
    drive.go(30, {})
    drive.go(5, HOUSE)
    drive.go(LAP - 38, {})
    return drive
