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
from rich.progress import Progress

from schemas.sensing import Pose
from services.sim import plan, town
from services.sim.camera import Exposure, StereoCamera, calibration
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
        if not any(plan.overlap((x_m, y_m, x_m, y_m), other.footprint, _MARGIN_M) for other in place.plots):
            return Pose(x_m=x_m, y_m=y_m, heading_rad=math.remainder(bearing + rng.normal(0, 0.35), math.tau))


def _on_a_street(place: town.Town, rng: np.random.Generator) -> Pose:
    road = place.roads[int(rng.integers(len(place.roads)))]
    x_m, y_m = road.point(rng.uniform(0, road.length_m), rng.uniform(-3, 3))
    heading = road.heading_rad + math.pi * int(rng.integers(2)) + rng.normal(0, 0.5)
    return Pose(x_m=x_m, y_m=y_m, heading_rad=math.remainder(heading, math.tau))


def render(seed: int, count: int, each: Callable[[], None] = lambda: None) -> Views:
    """`count` labelled views of the town of `seed`, as this file says above; `each` is called after every view."""
    world = World(town.generate(seed))
    try:
        camera = StereoCamera(world, calibration())
        views: dict[str, list[npt.ArrayLike]] = {key: [] for key in ("left", "right", "depth_m", "label", "pose")}
        for pose in viewpoints(world.town, count, np.random.default_rng([seed, 0xEE])):
            world.robot.place(pose)
            left, right = camera.survey()
            views["left"].append(left.image)
            views["right"].append(right.image)
            views["depth_m"].append(left.depth_m)
            views["label"].append(labels(world, left))
            views["pose"].append((pose.x_m, pose.y_m, pose.heading_rad))
            each()
    finally:
        world.close()
    known: Views = {
        "names": np.asarray(NAMES),
        "calibration": np.frombuffer(msgspec.json.encode(camera.calibration), np.uint8),
    }
    return known | {key: np.asarray(values) for key, values in views.items()}


def labels(world: World, exposure: Exposure) -> npt.NDArray[np.uint8]:
    """Which building each pixel shows, uint8 (h, w): 0 for none, else 1 + its place in NAMES."""
    label = np.zeros(exposure.body.shape, np.uint8)
    for body, name in world.building_of_body.items():
        label[exposure.body == body] = 1 + NAMES.index(name)
    return label


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m services.sim.renderings", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for town-SEED.npz")
    parser.add_argument("--seeds", type=int, nargs="+", default=[101, 102, 103], metavar="SEED", help="one town each")
    parser.add_argument("--views", type=int, default=200, metavar="N", help="views of each town (default 200)")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with Progress() as progress:
        task = progress.add_task("views", total=arguments.views * len(arguments.seeds))
        for seed in arguments.seeds:
            views = render(seed, arguments.views, lambda: progress.advance(task))
            np.savez_compressed(arguments.out / f"town-{seed}.npz", allow_pickle=False, **views)


if __name__ == "__main__":
    main()
