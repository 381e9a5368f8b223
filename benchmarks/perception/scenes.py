"""Held-out towns, and views of them from places and distances of their own, with what the simulator
knows of them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.robot import calibration
from cogmap.schemas.sensing import Calibration, Pose
from cogmap.services.sim.public import town
from cogmap.services.sim.rendering.public import StereoCamera, World
from cogmap.training.rendering import towns

# Towns to train on have seeds from 1001, those to validate on from 2001.
FIRST_SEED = 3101
NEAREST_M = 5.0
FARTHEST_M = 60.0
MIN_TURN_RAD = math.radians(45)
MIN_RATIO = 1.3
ENCOUNTER_M = (11.0, 22.0)
HALF_VIEW_RAD = math.radians(37.5)
RAYS = 96
MIN_WHOLE_RAYS = RAYS // 8
MARGIN_RAYS = 4
TRIES = 40
LOOKING_SD_RAD = 0.3
LATER_SD_RAD = 0.2
LANE_M = 3.5
Poses = Callable[[town.Town, np.random.Generator], Sequence[Pose]]


@dataclass(frozen=True, eq=False)
class Scene:
    """A stereo pair, uint8 (h, w, 3), and the truth of its left image, (h, w) each.

    `depth_m` is 0 in the sky, `label` 0 for no building, else 1 + its place among the town's plots,
    `surface` a row of `towns.SURFACES`.
    """

    left: Bytes
    right: Bytes
    depth_m: Singles
    label: Bytes
    surface: Bytes
    pose: Pose


@contextmanager
def drawn(
    seed: int, invented: int, poses: Poses, buildings: int | None = None
) -> Iterator[tuple[town.Town, Calibration, Iterator[Scene]]]:
    """Draw the town of `seed` with up to `invented` kinds that nobody was taught, or only so many
    `buildings` of it.

    Each of its scenes is drawn when it is asked for, in a light of its own.
    """
    whole = town.generate(seed, towns.kinds(seed, invented))
    place = replace(whole, plots=whole.plots[:buildings])
    world = World(place)

    try:
        camera = StereoCamera(world, calibration())
        rng = np.random.default_rng([seed, 0xBE])
        places = poses(place, rng)

        def scene(pose: Pose) -> Scene:
            view = towns.labelled(world, camera, pose, rng)
            return Scene(
                left=np.asarray(view["left"], np.uint8),
                right=np.asarray(view["right"], np.uint8),
                depth_m=np.asarray(view["depth_m"], np.float32),
                label=np.asarray(view["label"], np.uint8),
                surface=np.asarray(view["surface"], np.uint8),
                pose=pose,
            )

        yield place, camera.calibration, map(scene, places)
    finally:
        world.close()


def anywhere(count: int) -> Poses:
    """Draw `count` poses: half towards each building in turn, from any side and range, half on
    streets, looking anywhere.
    """

    def poses(place: town.Town, rng: np.random.Generator) -> list[Pose]:
        made = []
        for number in range(count):
            turn, is_on_street = divmod(number, 2)
            if is_on_street:
                road = place.roads[int(rng.integers(len(place.roads)))]
                along_m = float(rng.uniform(0, road.length_m))
                aside_m = float(rng.uniform(-LANE_M, LANE_M))
                x_m, y_m = road.point(along_m, aside_m)
                heading_rad = float(rng.uniform(-math.pi, math.pi))
                made.append(Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
            else:
                target = turn % len(place.plots)
                made.append(_towards(place, target, rng))

        return made

    return poses


def drive(metres: float, step_m: float) -> Poses:
    """Follow the town's loop from its start, corners turned on the spot."""

    def poses(place: town.Town, rng: np.random.Generator) -> list[Pose]:
        corners_m = np.asarray(place.line(1.0))
        made: list[Pose] = []

        for start_m, end_m in itertools.pairwise(corners_m):
            ahead_m = end_m - start_m
            length_m = math.hypot(*ahead_m)
            heading_rad = math.atan2(ahead_m[1], ahead_m[0])
            for share in np.arange(0.0, length_m, step_m) / length_m:
                x_m, y_m = (start_m + share * ahead_m).tolist()
                made.append(Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))

        return made[: round(metres / step_m)]

    return poses


def _turned(pose: Pose, turn_rad: float) -> Pose:
    heading_rad = pose.heading_rad + turn_rad
    return msgspec.structs.replace(pose, heading_rad=heading_rad)


def _towards(place: town.Town, target: int, rng: np.random.Generator) -> Pose:
    """Draw a pose that looks about towards a building, from anywhere that is free."""
    while True:
        range_m = float(rng.uniform(NEAREST_M, FARTHEST_M))
        side_rad = float(rng.uniform(-math.pi, math.pi))
        pose = facing(place, target, range_m, side_rad)

        if towns.is_free(place, pose.x_m, pose.y_m):
            turn_rad = float(rng.normal(0, LOOKING_SD_RAD))
            return _turned(pose, turn_rad)


def facing(place: town.Town, target: int, range_m: float, side_rad: float) -> Pose:
    """Return the pose that looks at the middle of plot `target` from `range_m` away in the
    direction `side_rad` of it.
    """
    plot = place.plots[target]
    back_rad = side_rad + math.pi
    return Pose(
        x_m=plot.x_m + range_m * math.cos(side_rad),
        y_m=plot.y_m + range_m * math.sin(side_rad),
        heading_rad=math.remainder(back_rad, math.tau),
    )


def side_and_range(place: town.Town, pose: Pose) -> Floats:
    """Return in which direction of each plot's middle the robot is, and how far, (plots, 2)."""
    middles_m = np.array([(plot.x_m, plot.y_m) for plot in place.plots])
    robot_m = np.array([pose.x_m, pose.y_m])
    x_m, y_m = (robot_m - middles_m).T

    side_rad = np.arctan2(y_m, x_m)
    range_m = np.hypot(x_m, y_m)
    return np.stack([side_rad, range_m], axis=1)


def skyline(place: town.Town, pose: Pose) -> npt.NDArray[np.intp]:
    """Find the nearest plot in each of RAYS directions across the view, from left to right, -1 if
    there is none.
    """
    bearings_rad = np.linspace(HALF_VIEW_RAD, -HALF_VIEW_RAD, RAYS)
    direction_rad = pose.heading_rad + bearings_rad
    rays = np.stack([np.cos(direction_rad), np.sin(direction_rad)], axis=1)
    footprints_m = np.array([plot.footprint for plot in place.plots])
    corners_m = footprints_m.reshape(-1, 2, 2) - (pose.x_m, pose.y_m)

    # Where each ray crosses the lines of a footprint's sides: (rays, plots, corners, axes).
    with np.errstate(divide="ignore"):
        crossings_m = corners_m / rays[:, None, None]

    enter_m = crossings_m.min(axis=2).max(axis=2)
    leave_m = crossings_m.max(axis=2).min(axis=2)
    is_hit = (enter_m <= leave_m) & (enter_m > 0)
    range_m = np.where(is_hit, enter_m, np.inf)
    return np.where(is_hit.any(axis=1), range_m.argmin(axis=1), -1)


def encounter(place: town.Town, target: int, rng: np.random.Generator) -> Pose:
    """Draw a pose at a fair distance from a building, on any side. Of a few tries it is the one
    with the least of other buildings in the view.
    """
    best = None
    min_cost = 2 * RAYS

    for _ in range(TRIES):
        range_m = float(rng.uniform(*ENCOUNTER_M))
        side_rad = float(rng.uniform(-math.pi, math.pi))
        pose = facing(place, target, range_m, side_rad)
        # How much more of others is seen than of the target; RAYS more unless it is seen whole.
        seen = skyline(place, pose)
        own = np.count_nonzero(seen == target)
        others = np.count_nonzero(seen >= 0) - own
        is_whole = own >= MIN_WHOLE_RAYS and target not in (seen[0], seen[-1])
        cost = int(others - own) + (0 if is_whole else RAYS)

        if cost < min_cost and towns.is_free(place, pose.x_m, pose.y_m):
            best = pose
            min_cost = cost

    return best or _towards(place, target, rng)


def later(place: town.Town, target: int, first: Pose, rng: np.random.Generator) -> Pose | None:
    """Draw a pose that looks at plot `target` from another side and distance than `first` did,
    about towards it; return None if it is hidden.
    """
    side_rad, first_m = side_and_range(place, first)[target].tolist()

    for _ in range(TRIES):
        around_rad = float(rng.uniform(MIN_TURN_RAD, math.tau - MIN_TURN_RAD))
        distance_m = float(rng.uniform(NEAREST_M, FARTHEST_M))
        towards = facing(place, target, distance_m, side_rad + around_rad)
        turn_rad = float(rng.normal(0, LATER_SD_RAD))
        pose = _turned(towards, turn_rad)

        _, range_m = side_and_range(place, pose)[target].tolist()
        if not other_distance(range_m, first_m) or not towns.is_free(place, pose.x_m, pose.y_m):
            continue

        rays = np.count_nonzero(skyline(place, pose) == target)
        if rays >= MARGIN_RAYS:
            return pose

    return None


def other_distance(range_m: float, first_m: float) -> bool:
    """Decide whether `range_m` differs from `first_m`: a third more, or less by as much."""
    return max(range_m, first_m) >= MIN_RATIO * min(range_m, first_m)
