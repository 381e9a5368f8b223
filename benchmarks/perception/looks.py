"""What perception makes of one held-out town: a task for a process, and what it gives back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.perception import depth, road, streets
from benchmarks.perception.novel import Meeting, Memory, remembered
from benchmarks.perception.objects import Claim, Sight, claims, right_or_not, sight
from benchmarks.perception.pipeline import CandidateProbe, PerceptionPipeline
from benchmarks.perception.scenes import Scene, anywhere, drawn, encounter, later, side_and_range
from schemas.sensing import Pose
from services.epam.layout.road import load
from services.sim.layout.catalogue import CATALOGUE
from services.sim.layout.plan import STREET_WIDTH_M
from services.sim.layout.town import Town
from training.rendering.towns import KINDS

TRAINED = frozenset(kind.name for kind in CATALOGUE)
NOVEL = 20
EVERY = 16
Tick = Callable[[], None]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Look:
    """One town: what was seen of its buildings, `judged` pairs of activation and rightness, and
    errors of each point, and of one pixel in EVERY.
    """

    sights: list[Sight]
    judged: list[tuple[float, bool]]
    road_iou: float
    edge_errors_m: Floats
    edges_missed_m: Floats
    depth_errors: npt.NDArray[np.float32]
    depth_known: float


def town_look(seed: int, invented: int, views: int, tick: Tick) -> Look:
    """Look at the town of `seed` from `views` places, with fresh eyes."""
    sights = []
    candidates = []
    masks = []
    surfaces = []
    off = []
    missed = []
    depths = []
    roads = load()
    probe = CandidateProbe()
    with drawn(seed, invented, anywhere(views)) as (place, camera, scenes):
        eyes = PerceptionPipeline(camera)
        edges = streets.edges([each.area(STREET_WIDTH_M / 2) for each in place.roads])
        for scene in scenes:
            result = eyes.see(scene.left, scene.right)
            view = result.view
            percepts = result.percepts
            sights.append(_sight(claims(percepts.objects, scene.label.shape), place, scene))
            candidates.append(_sight(probe.candidates(result), place, scene))
            masks.append(roads.mask(view.image.numpy().astype(np.uint8, copy=False)))
            surfaces.append(scene.surface)
            boundary_m = percepts.road_boundary_m.numpy()
            off.append(streets.distances_m(streets.in_town(boundary_m, scene.pose), edges))
            missed.append(
                road.road_edges_missed_m(boundary_m, scene.surface, scene.depth_m, camera)
            )
            depths.append(
                depth.errors(view.depth_m.numpy().astype(np.float32, copy=False), scene.depth_m)
            )
            tick()
    return Look(
        sights=sights,
        judged=right_or_not(candidates, sights, TRAINED),
        road_iou=road.road_iou(np.asarray(masks), np.asarray(surfaces)),
        edge_errors_m=np.concatenate(off),
        edges_missed_m=np.concatenate(missed),
        depth_errors=np.concatenate([errors[::EVERY] for errors, _ in depths]),
        depth_known=float(np.mean([known for _, known in depths])),
    )


def novel_look(seed: int, sightings: int, tick: Tick) -> Memory:
    """Meet NOVEL invented buildings of the town of `seed` once each, then see each up to
    `sightings` times more.
    """

    def poses(place: Town, rng: np.random.Generator) -> list[Pose]:
        first = [encounter(place, target, rng) for target in range(NOVEL)]
        order = rng.permutation(np.repeat(np.arange(NOVEL), sightings)).tolist()
        again = [later(place, target, first[target], rng) for target in order]
        return first + [pose for pose in again if pose is not None]

    with drawn(seed, KINDS, poses, NOVEL) as (place, camera, scenes):
        eyes = PerceptionPipeline(camera)
        meetings = []
        for scene in scenes:
            percepts = eyes.see(scene.left, scene.right).percepts.objects
            seen = _sight(claims(percepts, scene.label.shape), place, scene)
            meetings.append(Meeting(seen, side_and_range(place, scene.pose)))
            tick()
    return remembered(meetings[:NOVEL], meetings[NOVEL:], TRAINED)


def _sight(made: Sequence[Claim], place: Town, scene: Scene) -> Sight:
    kinds = [plot.kind.name for plot in place.plots]
    return sight(made, scene.label, kinds, side_and_range(place, scene.pose)[:, 1].tolist())
