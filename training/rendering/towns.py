"""Labelled renderings of towns, to learn what buildings and streets look like.

One file `town-SEED.npz` a town: `left`, `right` uint8 (n, h, w, 3), as the cameras gave them, each
pair in a light of its own; for the left one `depth_m` float32 (n, h, w) along the optical axis (0
in the sky), `label` uint8 (n, h, w), 0 for no building, else 1 + its row in `names`, and `surface`
uint8 (n, h, w), its row in SURFACES; `pose` float64 (n, 3) of the robot: x_m, y_m, heading_rad.
`names` (k,) are the town's buildings, `place_m` float64 (k, 2) their centres, `size_m` float64
(k, 3) their width, depth and height; `calibration` is the camera's, as JSON bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Bytes
from cogmap.robot import calibration
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout import plan, town
from cogmap.services.sim.layout.blocks import town as blocks
from cogmap.services.sim.layout.blocks.strangers import of_strangers
from cogmap.services.sim.layout.catalogue import CATALOGUE, BuildingType, invented
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.rendering.camera import Exposure, StereoCamera
from cogmap.services.sim.rendering.light import some_light
from cogmap.services.sim.world import World
from cogmap.training.rendering.reader import SURFACES

KINDS = 30
BUILDING_MARGIN_M = 3.0
PROP_MARGIN_M = 0.7
Views = dict[str, npt.NDArray[np.generic]]


def kinds(seed: int, invented_count: int) -> tuple[BuildingType, ...]:
    """Return the kinds of building of the town of `seed`: this number of invented ones, and others
    of the catalogue.
    """
    if not invented_count:
        return CATALOGUE

    rng = np.random.default_rng([seed, 0xCA])
    order = rng.permutation(len(CATALOGUE))
    known_count = max(0, KINDS - invented_count)
    chosen = order[:known_count]
    known = [CATALOGUE[number] for number in chosen]
    return (*invented(seed, invented_count), *known)


def viewpoints(place: Place, count: int, rng: np.random.Generator) -> Iterator[Pose]:
    """Yield `count` poses in `place`: every second one on a street, about along it, the others
    anywhere free, about towards a building.
    """
    for number in range(count):
        if number % 2 == 0:
            road = place.roads[int(rng.integers(len(place.roads)))]
            along_m = rng.uniform(0, road.length_m)
            x_m, y_m = road.point(along_m, rng.uniform(-3, 3))
            half_turns = int(rng.integers(2))
            heading_rad = road.heading_rad + math.pi * half_turns + rng.normal(0, 0.5)
        else:
            plot = place.plots[int(rng.integers(len(place.plots)))]
            while True:
                range_m = rng.uniform(6, 60)
                bearing_rad = rng.uniform(-math.pi, math.pi)
                x_m = plot.x_m - range_m * math.cos(bearing_rad)
                y_m = plot.y_m - range_m * math.sin(bearing_rad)
                if is_free(place, x_m, y_m):
                    break
            heading_rad = bearing_rad + rng.normal(0, 0.35)

        yield Pose(x_m=x_m, y_m=y_m, heading_rad=math.remainder(heading_rad, math.tau))


def is_free(place: Place, x_m: float, y_m: float) -> bool:
    """Return true if the robot can stand there, away from buildings and outside of props."""
    here = (x_m, y_m, x_m, y_m)
    return not any(
        plan.overlap(here, plot.footprint, BUILDING_MARGIN_M) for plot in place.plots
    ) and not any(plan.overlap(here, prop.area, PROP_MARGIN_M) for prop in place.props)


def render_town(seed: int, count: int, invented_count: int = 0) -> Views:
    """Return `count` labelled views of the small town of `seed`, with this number of invented kinds
    of building.
    """
    return render(town.generate(seed, kinds(seed, invented_count)), count)


def render_blocks(seed: int, count: int) -> Views:
    """Return `count` labelled views of the town of blocks of `seed`, whose buildings are
    invented.
    """
    return render(of_strangers(blocks.generate(seed)), count)


def render(place: Place, count: int) -> Views:
    """Return `count` labelled views of a town."""
    world = World(place)
    try:
        camera = StereoCamera(world, calibration())
        rng = np.random.default_rng([place.seed, 0xEE])
        views = [labelled(world, camera, pose, rng) for pose in viewpoints(place, count, rng)]
    finally:
        world.close()

    kinds_of_plots = [plot.kind for plot in place.plots]
    sizes_m = [(kind.width_m, kind.depth_m, kind.height_m) for kind in kinds_of_plots]
    encoded = msgspec.json.encode(camera.calibration)
    town_views = {
        "names": np.asarray([kind.name for kind in kinds_of_plots]),
        "place_m": np.asarray([(plot.x_m, plot.y_m) for plot in place.plots]),
        "size_m": np.asarray(sizes_m),
        "calibration": np.frombuffer(encoded, np.uint8),
    }
    return town_views | {key: np.asarray([view[key] for view in views]) for key in views[0]}


def labelled(
    world: World, camera: StereoCamera, pose: Pose, rng: np.random.Generator
) -> dict[str, npt.ArrayLike]:
    """Return one view from `pose` in some light, with its labels."""
    world.robot.place(pose)
    left, right = camera.capture_labelled(some_light(rng), rng)
    return {
        "left": left.image,
        "right": right.image,
        "depth_m": left.depth_m,
        "label": labels(world, left),
        "surface": surfaces(world, left),
        "pose": (pose.x_m, pose.y_m, pose.heading_rad),
    }


def labels(world: World, exposure: Exposure) -> Bytes:
    """Return which building each pixel shows, uint8 (h, w): 0 for none, else 1 + its row among the
    town's.
    """
    label = np.zeros(exposure.body.shape, np.uint8)
    for number, body in enumerate(world.building_of_body):
        label[exposure.body == body] = 1 + number
    return label


def surfaces(world: World, exposure: Exposure) -> Bytes:
    """Return what each pixel shows, uint8 (h, w): rows of SURFACES."""
    bodies_of = {
        "sky": [world.sky],
        "road": world.streets,
        "building": world.building_of_body,
        "prop": world.props,
    }
    surface = np.full(exposure.body.shape, SURFACES.index("ground"), np.uint8)
    for name, bodies in bodies_of.items():
        surface[np.isin(exposure.body, list(bodies))] = SURFACES.index(name)

    surface[exposure.body < 0] = SURFACES.index("sky")
    return surface
