"""Labelled renderings of towns, for learning what buildings look like.

One `town-SEED.npz` a town: `left`, `right` uint8 (n, h, w, 3), as the cameras gave them; for the left one `depth_m`
float32 (n, h, w) along the optical axis (0 in the sky) and `label` uint8 (n, h, w), 0 for no building, else 1 + the
row of `names`, which is the same in every file; `pose` float64 (n, 3) of the robot: x_m, y_m, heading_rad; and
`calibration`, the camera's, as JSON bytes.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt
from rich.progress import track

from schemas.sensing import Pose
from services.sim import town
from services.sim.camera import StereoCamera, calibration
from services.sim.catalogue import CATALOGUE
from services.sim.world import World

NAMES = tuple(kind.name for kind in CATALOGUE)
_MARGIN_M = 3.0
Views = dict[str, npt.NDArray[np.generic]]


def viewpoints(place: town.Town, count: int, rng: np.random.Generator) -> Iterator[Pose]:
    """`count` poses in `place`: half on its streets, about along them, half anywhere free, about towards a building."""
    for number in range(count):
        yield _on_a_street(place, rng) if number % 2 == 0 else _facing_a_building(place, rng)


def _facing_a_building(place: town.Town, rng: np.random.Generator) -> Pose:
    plot = place.plots[int(rng.integers(len(place.plots)))]
    while True:
        range_m, bearing = rng.uniform(6, 60), rng.uniform(-math.pi, math.pi)
        x_m, y_m = plot.x_m - range_m * math.cos(bearing), plot.y_m - range_m * math.sin(bearing)
        if not any(_within(other.footprint, x_m, y_m) for other in place.plots):
            return Pose(x_m=x_m, y_m=y_m, heading_rad=math.remainder(bearing + rng.normal(0, 0.35), math.tau))


def _on_a_street(place: town.Town, rng: np.random.Generator) -> Pose:
    road = place.roads[int(rng.integers(len(place.roads)))]
    (ax, ay), (bx, by) = road.start, road.end
    along = math.atan2(by - ay, bx - ax) + math.pi * int(rng.integers(2)) + rng.normal(0, 0.5)
    share, side_m = rng.uniform(0, 1), rng.uniform(-3, 3)
    unit_x, unit_y = (bx - ax) / math.hypot(bx - ax, by - ay), (by - ay) / math.hypot(bx - ax, by - ay)
    x_m, y_m = ax + share * (bx - ax) - side_m * unit_y, ay + share * (by - ay) + side_m * unit_x
    return Pose(x_m=x_m, y_m=y_m, heading_rad=math.remainder(along, math.tau))


def _within(area: town.Rectangle, x_m: float, y_m: float) -> bool:
    west, south, east, north = area
    return west - _MARGIN_M < x_m < east + _MARGIN_M and south - _MARGIN_M < y_m < north + _MARGIN_M


def render(seed: int, count: int, size_px: tuple[int, int] = (320, 240), each: Callable[[], None] | None = None) -> Views:
    """`count` labelled views of the town of `seed`, as the module's docstring says; `each` is called after each view."""
    world = World(town.generate(seed))
    try:
        camera = StereoCamera(world, calibration(*size_px))
        classes = np.zeros(1 + max(world.building_of_body), np.uint8)
        for body, name in world.building_of_body.items():
            classes[body] = 1 + NAMES.index(name)
        columns: dict[str, list[npt.ArrayLike]] = {key: [] for key in ("left", "right", "depth_m", "label", "pose")}
        for pose in viewpoints(world.town, count, np.random.default_rng([seed, 0xEE])):
            world.robot.place(pose)
            left, right = camera.survey()
            inside = (left.body >= 0) & (left.body < len(classes))
            label = np.where(inside, classes[np.where(inside, left.body, 0)], 0).astype(np.uint8)
            row = (left.image, right.image, left.depth_m, label, (pose.x_m, pose.y_m, pose.heading_rad))
            for key, value in zip(columns, row, strict=True):
                columns[key].append(value)
            if each:
                each()
        views: Views = {key: np.asarray(values) for key, values in columns.items()}
        views["names"] = np.asarray(NAMES)
        views["calibration"] = np.frombuffer(msgspec.json.encode(camera.calibration), np.uint8)
        return views
    finally:
        world.close()


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m services.sim.renderings", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for town-SEED.npz")
    parser.add_argument("--seeds", type=int, nargs="+", default=[101, 102, 103], metavar="SEED", help="one town each")
    parser.add_argument("--views", type=int, default=200, metavar="N", help="views of each town (default 200)")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for seed in track(arguments.seeds, "towns"):
        np.savez_compressed(arguments.out / f"town-{seed}.npz", **render(seed, arguments.views))  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
