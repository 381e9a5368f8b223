"""Held-out towns, and views of them from places and distances of their own, with what the simulator
knows of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration, Pose
from services.sim.layout import town
from services.sim.rendering.camera import StereoCamera, calibration
from services.sim.world import World
from training.rendering import towns

# Towns to train on have seeds from 1001, those to validate on from 2001.
FIRST_SEED = 3101
NEAREST_M = 5.0
FARTHEST_M = 60.0
MIN_TURN_RAD = math.radians(45)
MIN_RATIO = 1.3
ENCOUNTER_M = (11.0, 22.0)
HALF_VIEW_RAD = math.radians(37.5)
RAYS = 96
MARGIN_RAYS = 4
TRIES = 40
Bytes = npt.NDArray[np.uint8]
Floats32 = npt.NDArray[np.float32]
Floats = npt.NDArray[np.float64]
Poses = Callable[[town.Town, np.random.Generator], Sequence[Pose]]


@dataclass(frozen=True, eq=False)
class Scene:
    """A stereo pair, uint8 (h, w, 3), and the truth of its left image, (h, w) each.

    `depth_m` is 0 in the sky, `label` 0 for no building, else 1 + its place among the town's plots,
    `surface` a row of `towns.SURFACES`.
    """

    left: Bytes
    right: Bytes
    depth_m: Floats32
    label: Bytes
    surface: Bytes
    pose: Pose


@contextmanager
def drawn(
    seed: int, invented: int, poses: Poses, buildings: int | None = None
) -> Iterator[tuple[town.Town, Calibration, Iterator[Scene]]]:
    """The town of `seed` with up to `invented` kinds that nobody was taught, or only so many
    `buildings` of it.

    Its scenes are each drawn when asked for, in a light of its own.
    """
    place = town.generate(seed, towns.kinds(seed, invented))
    place = replace(place, plots=place.plots[:buildings])
    world = World(place)
    try:
        camera = StereoCamera(world, calibration())
        rng = np.random.default_rng([seed, 0xBE])
        places = poses(place, rng)
        yield place, camera.calibration, (_scene(world, camera, pose, rng) for pose in places)
    finally:
        world.close()


def _scene(world: World, camera: StereoCamera, pose: Pose, rng: np.random.Generator) -> Scene:
    view = towns.labelled(world, camera, pose, rng)
    return Scene(
        left=np.asarray(view["left"], np.uint8),
        right=np.asarray(view["right"], np.uint8),
        depth_m=np.asarray(view["depth_m"], np.float32),
        label=np.asarray(view["label"], np.uint8),
        surface=np.asarray(view["surface"], np.uint8),
        pose=pose,
    )


def anywhere(count: int) -> Poses:
    """`count` poses: half towards each building in turn, from any side and range, half on streets,
    looking anywhere.
    """

    def poses(place: town.Town, rng: np.random.Generator) -> list[Pose]:
        made = []
        for number in range(count):
            target = number // 2 % len(place.plots)
            made.append(_on_a_street(place, rng) if number % 2 else _towards(place, target, rng))
        return made

    return poses


def drive(metres: float, step_m: float) -> Poses:
    """A way along the town's loop from its start, corners turned on the spot."""

    def poses(place: town.Town, rng: np.random.Generator) -> list[Pose]:
        line = np.asarray(place.line(1.0))
        made = []
        for (x0, y0), (x1, y1) in zip(line[:-1].tolist(), line[1:].tolist(), strict=True):
            heading = math.atan2(y1 - y0, x1 - x0)
            length = math.hypot(x1 - x0, y1 - y0)
            steps = np.arange(0.0, length, step_m) / length
            made += [
                Pose(x_m=x0 + s * (x1 - x0), y_m=y0 + s * (y1 - y0), heading_rad=heading)
                for s in steps.tolist()
            ]
        return made[: round(metres / step_m)]

    return poses


def _towards(place: town.Town, target: int, rng: np.random.Generator) -> Pose:
    while True:
        pose = facing(
            place,
            target,
            float(rng.uniform(NEAREST_M, FARTHEST_M)),
            float(rng.uniform(-math.pi, math.pi)),
        )
        if towns.is_free(place, pose.x_m, pose.y_m):
            return Pose(
                x_m=pose.x_m, y_m=pose.y_m, heading_rad=pose.heading_rad + float(rng.normal(0, 0.3))
            )


def _on_a_street(place: town.Town, rng: np.random.Generator) -> Pose:
    road = place.roads[int(rng.integers(len(place.roads)))]
    x_m, y_m = road.point(float(rng.uniform(0, road.length_m)), float(rng.uniform(-3.5, 3.5)))
    return Pose(x_m=x_m, y_m=y_m, heading_rad=float(rng.uniform(-math.pi, math.pi)))


def facing(place: town.Town, target: int, range_m: float, side_rad: float) -> Pose:
    """The pose that looks at the middle of plot `target` from `range_m` away in the direction
    `side_rad` of it.
    """
    plot = place.plots[target]
    x_m = plot.x_m + range_m * math.cos(side_rad)
    y_m = plot.y_m + range_m * math.sin(side_rad)
    return Pose(x_m=x_m, y_m=y_m, heading_rad=math.remainder(side_rad + math.pi, math.tau))


def side_and_range(place: town.Town, pose: Pose) -> Floats:
    """In which direction of each plot's middle the robot is, and how far away, (plots, 2)."""
    off = np.array([(pose.x_m - plot.x_m, pose.y_m - plot.y_m) for plot in place.plots])
    return np.stack([np.arctan2(off[:, 1], off[:, 0]), np.hypot(off[:, 0], off[:, 1])], axis=1)


def skyline(place: town.Town, pose: Pose) -> npt.NDArray[np.intp]:
    """The nearest plot in each of RAYS directions across the view, from left to right, -1 where
    there is none.
    """
    bearing = pose.heading_rad + np.linspace(HALF_VIEW_RAD, -HALF_VIEW_RAD, RAYS)
    way = np.stack([np.cos(bearing), np.sin(bearing)], axis=1)[:, None]
    area = np.array([plot.footprint for plot in place.plots]).reshape(1, -1, 2, 2)
    with np.errstate(divide="ignore"):
        hits = (area - (pose.x_m, pose.y_m)) / way[:, :, None]
    enter = hits.min(axis=2).max(axis=2)
    leave = hits.max(axis=2).min(axis=2)
    range_m = np.where((enter <= leave) & (enter > 0), enter, np.inf)
    return np.where(np.isfinite(range_m.min(axis=1)), range_m.argmin(axis=1), -1)


def encounter(place: town.Town, target: int, rng: np.random.Generator) -> Pose:
    """From a fair distance, on any side, with as little of other buildings in the view as a few
    tries find.
    """
    best = None
    fewest = 2 * RAYS
    for _ in range(TRIES):
        pose = facing(
            place, target, float(rng.uniform(*ENCOUNTER_M)), float(rng.uniform(-math.pi, math.pi))
        )
        seen = skyline(place, pose)
        own = np.count_nonzero(seen == target)
        others = np.count_nonzero((seen >= 0) & (seen != target))
        whole = seen[0] != target != seen[-1] and own >= RAYS // 8
        score = int(others - own) + (0 if whole else RAYS)
        if towns.is_free(place, pose.x_m, pose.y_m) and score < fewest:
            best = pose
            fewest = score
    return best or _towards(place, target, rng)


def later(place: town.Town, target: int, first: Pose, rng: np.random.Generator) -> Pose | None:
    """Looking at plot `target` from another side and distance than `first` did, about towards it,
    None if hidden.
    """
    side_rad, range_m = side_and_range(place, first)[target].tolist()
    for _ in range(TRIES):
        turned = side_rad + float(rng.uniform(MIN_TURN_RAD, math.tau - MIN_TURN_RAD))
        pose = facing(place, target, float(rng.uniform(NEAREST_M, FARTHEST_M)), turned)
        pose = Pose(
            x_m=pose.x_m, y_m=pose.y_m, heading_rad=pose.heading_rad + float(rng.normal(0, 0.2))
        )
        there_m = side_and_range(place, pose)[target, 1]
        clear = np.count_nonzero(skyline(place, pose) == target) >= MARGIN_RAYS
        if clear and other_distance(there_m, range_m) and towns.is_free(place, pose.x_m, pose.y_m):
            return pose
    return None


def other_distance(range_m: float, first_m: float) -> bool:
    """Whether `range_m` is another distance than `first_m`: a third more, or less by as much."""
    return max(range_m, first_m) >= MIN_RATIO * min(range_m, first_m)
