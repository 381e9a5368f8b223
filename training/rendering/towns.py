"""Labelled renderings of towns, for learning what buildings and streets look like.

One `town-SEED.npz` a town: `left`, `right` uint8 (n, h, w, 3), as the cameras gave them, each pair
in a light of its own; for the left one `depth_m` float32 (n, h, w) along the optical axis (0 in the
sky), `label` uint8 (n, h, w), 0 for no building, else 1 + its row in `names`, and `surface` uint8
(n, h, w), its row in SURFACES; `pose` float64 (n, 3) of the robot: x_m, y_m, heading_rad. `names`
(k,) are the town's buildings, `place_m` float64 (k, 2) their centres, `size_m` float64 (k, 3) their
width, depth and height; `calibration` is the camera's, as JSON bytes.
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
from services.sim.layout import plan, town
from services.sim.layout.catalogue import CATALOGUE, BuildingType, invented
from services.sim.rendering.camera import Exposure, StereoCamera, calibration
from services.sim.rendering.light import some_light
from services.sim.world import World

SURFACES = ("sky", "ground", "road", "building", "prop")
KINDS = 30
_MARGIN_M = 3.0
Views = dict[str, npt.NDArray[np.generic]]


def kinds(seed: int, unknown: int) -> tuple[BuildingType, ...]:
    """What the town of `seed` may be built of: `unknown` invented kinds, and others of the
    catalogue.
    """
    if not unknown:
        return CATALOGUE
    order = np.random.default_rng([seed, 0xCA]).permutation(len(CATALOGUE))
    known = [CATALOGUE[number] for number in order[: max(0, KINDS - unknown)]]
    return (*invented(seed, unknown), *known)


def viewpoints(place: town.Town, count: int, rng: np.random.Generator) -> Iterator[Pose]:
    """`count` poses in `place`: half on its streets, about along them, half anywhere free, about
    towards a building.
    """
    for number in range(count):
        yield _on_a_street(place, rng) if number % 2 == 0 else _facing_a_building(place, rng)


def _facing_a_building(place: town.Town, rng: np.random.Generator) -> Pose:
    plot = place.plots[int(rng.integers(len(place.plots)))]
    while True:
        range_m = rng.uniform(6, 60)
        bearing = rng.uniform(-math.pi, math.pi)
        x_m = plot.x_m - range_m * math.cos(bearing)
        y_m = plot.y_m - range_m * math.sin(bearing)
        if is_free(place, x_m, y_m):
            return Pose(
                x_m=x_m,
                y_m=y_m,
                heading_rad=math.remainder(bearing + rng.normal(0, 0.35), math.tau),
            )


def is_free(place: town.Town, x_m: float, y_m: float) -> bool:
    """Whether the robot can stand there, away from buildings and outside of props."""
    here = (x_m, y_m, x_m, y_m)
    near = any(plan.overlap(here, plot.footprint, _MARGIN_M) for plot in place.plots)
    return not near and not any(plan.overlap(here, prop.area, 0.7) for prop in place.props)


def _on_a_street(place: town.Town, rng: np.random.Generator) -> Pose:
    road = place.roads[int(rng.integers(len(place.roads)))]
    x_m, y_m = road.point(rng.uniform(0, road.length_m), rng.uniform(-3, 3))
    heading = road.heading_rad + math.pi * int(rng.integers(2)) + rng.normal(0, 0.5)
    return Pose(x_m=x_m, y_m=y_m, heading_rad=math.remainder(heading, math.tau))


def render(
    seed: int, count: int, unknown: int = 0, each: Callable[[], None] = lambda: None
) -> Views:
    """`count` labelled views of the town of `seed`, with `unknown` invented kinds; `each` is called
    after each view.
    """
    place = town.generate(seed, kinds(seed, unknown))
    world = World(place)
    try:
        camera = StereoCamera(world, calibration())
        rng = np.random.default_rng([seed, 0xEE])
        views: dict[str, list[npt.ArrayLike]] = {}
        for pose in viewpoints(place, count, rng):
            for key, value in labelled(world, camera, pose, rng).items():
                views.setdefault(key, []).append(value)
            each()
    finally:
        world.close()
    return _known(world, camera) | {key: np.asarray(values) for key, values in views.items()}


def labelled(
    world: World, camera: StereoCamera, pose: Pose, rng: np.random.Generator
) -> dict[str, npt.ArrayLike]:
    """One view from `pose` in some light, with its labels."""
    world.robot.place(pose)
    left, right = camera.survey(some_light(rng), rng)
    return {
        "left": left.image,
        "right": right.image,
        "depth_m": left.depth_m,
        "label": labels(world, left),
        "surface": surfaces(world, left),
        "pose": (pose.x_m, pose.y_m, pose.heading_rad),
    }


def _known(world: World, camera: StereoCamera) -> Views:
    plots = world.town.plots
    return {
        "names": np.asarray([plot.kind.name for plot in plots]),
        "place_m": np.asarray([(plot.x_m, plot.y_m) for plot in plots]),
        "size_m": np.asarray(
            [(plot.kind.width_m, plot.kind.depth_m, plot.kind.height_m) for plot in plots]
        ),
        "calibration": np.frombuffer(msgspec.json.encode(camera.calibration), np.uint8),
    }


def labels(world: World, exposure: Exposure) -> npt.NDArray[np.uint8]:
    """Which building each pixel shows, uint8 (h, w): 0 for none, else 1 + its place among the
    town's.
    """
    label = np.zeros(exposure.body.shape, np.uint8)
    for number, body in enumerate(world.building_of_body):
        label[exposure.body == body] = 1 + number
    return label


def surfaces(world: World, exposure: Exposure) -> npt.NDArray[np.uint8]:
    """What each pixel shows, uint8 (h, w): rows of SURFACES."""
    surface = np.ones(exposure.body.shape, np.uint8)
    shown = ((world.sky,), world.streets, world.building_of_body, world.props)
    for number, bodies in zip((0, 2, 3, 4), shown, strict=True):
        surface[np.isin(exposure.body, list(bodies))] = number
    surface[exposure.body < 0] = 0
    return surface


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m training.rendering.towns", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for town-SEED.npz"
    )
    parser.add_argument(
        "--seeds",
        type=int,
        nargs="+",
        default=[101, 102, 103],
        metavar="SEED",
        help="one town each",
    )
    parser.add_argument(
        "--views", type=int, default=200, metavar="N", help="views of each town (default 200)"
    )
    parser.add_argument(
        "--invented",
        type=int,
        default=0,
        metavar="N",
        help=f"up to N of its {KINDS} kinds of building are invented",
    )
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with Progress() as progress:
        task = progress.add_task("views", total=arguments.views * len(arguments.seeds))
        for seed in arguments.seeds:
            views = render(
                seed, arguments.views, arguments.invented, lambda: progress.advance(task)
            )
            np.savez(arguments.out / f"town-{seed}.npz", allow_pickle=False, **views)


if __name__ == "__main__":
    main()
