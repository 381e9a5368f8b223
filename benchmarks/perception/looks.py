"""What perception makes of one held-out town: a job for a process, and what it returns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.perception import depth, road, streets
from benchmarks.perception.novel import Meeting, Memory, remembered
from benchmarks.perception.objects import Claim, Sight, claims, right_or_not, sight
from benchmarks.perception.pipeline import CandidateProbe, PerceptionPipeline, Result
from benchmarks.perception.scenes import (
    Poses,
    Scene,
    anywhere,
    drawn,
    encounter,
    later,
    side_and_range,
)
from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration, Pose
from cogmap.services.epam.layout.road import load
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.sim.layout.plan import STREET_WIDTH_M
from cogmap.services.sim.layout.town import Town
from cogmap.training.rendering.towns import KINDS

TRAINED = frozenset(kind.name for kind in CATALOGUE)
NOVEL = 20
EVERY = 16


@dataclass(frozen=True, eq=False)
class Look:
    """One town: what was seen of its buildings, `judged` pairs of activation and rightness.

    Errors are of each point of the road's edge, and of the depth of one pixel in EVERY.
    """

    sights: list[Sight]
    judged: list[tuple[float, bool]]
    road_iou: float
    edge_errors_m: Floats
    edges_missed_m: Floats
    depth_errors: Singles
    depth_known: float


def town_look(seed: int, invented: int, views: int) -> Look:
    """Look at the town of `seed` from `views` places; nothing was learned before."""
    with drawn(seed, invented, anywhere(views)) as (place, camera, scenes):
        pipeline = PerceptionPipeline(camera)
        tally = _Tally(place, camera)

        for scene in scenes:
            tally.add(scene, pipeline.process(scene.left, scene.right))

    return tally.look()


@dataclass
class _Tally:
    """What has been seen so far of one town."""

    place: Town
    camera: Calibration
    sights: list[Sight] = field(default_factory=list)
    candidates: list[Sight] = field(default_factory=list)
    masks: list[np.ndarray] = field(default_factory=list)
    surfaces: list[Bytes] = field(default_factory=list)
    edge_errors_m: list[Floats] = field(default_factory=list)
    edges_missed_m: list[Floats] = field(default_factory=list)
    depth_errors: list[Singles] = field(default_factory=list)
    depth_known: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._roads = load()
        self._probe = CandidateProbe()

        half_width_m = STREET_WIDTH_M / 2
        areas = [street.area(half_width_m) for street in self.place.roads]
        self._edges = streets.edges(areas)

    def add(self, scene: Scene, result: Result) -> None:
        """One view, and what was made of it."""
        percepts = claims(result.percepts.objects, scene.label.shape)
        candidates = self._probe.candidates(result)
        self.sights.append(_sight(percepts, self.place, scene))
        self.candidates.append(_sight(candidates, self.place, scene))
        self._add_road_mask(scene, result)
        self._add_road_edges(scene, result)
        self._add_depth(scene, result)

    def _add_road_mask(self, scene: Scene, result: Result) -> None:
        image = result.view.image.numpy()
        mask = self._roads.mask(image.astype(np.uint8, copy=False))

        self.masks.append(mask)
        self.surfaces.append(scene.surface)

    def _add_road_edges(self, scene: Scene, result: Result) -> None:
        boundary_m = result.percepts.road_boundary_m.numpy()
        in_town_m = streets.in_town(boundary_m, scene.pose)
        errors_m = streets.distances_m(in_town_m, self._edges)
        missed_m = road.road_edges_missed_m(
            boundary_m,
            scene.surface,
            scene.depth_m,
            self.camera,
        )
        self.edge_errors_m.append(errors_m)
        self.edges_missed_m.append(missed_m)

    def _add_depth(self, scene: Scene, result: Result) -> None:
        found_m = result.view.depth_m.numpy()
        depth_m = found_m.astype(np.float32, copy=False)
        relative, known = depth.errors(depth_m, scene.depth_m)

        self.depth_errors.append(relative[::EVERY])
        self.depth_known.append(known)

    def look(self) -> Look:
        """All views together."""
        masks = np.asarray(self.masks)
        surfaces = np.asarray(self.surfaces)

        return Look(
            sights=self.sights,
            judged=right_or_not(self.candidates, self.sights, TRAINED),
            road_iou=road.road_iou(masks, surfaces),
            edge_errors_m=np.concatenate(self.edge_errors_m),
            edges_missed_m=np.concatenate(self.edges_missed_m),
            depth_errors=np.concatenate(self.depth_errors),
            depth_known=float(np.mean(self.depth_known)),
        )


def novel_look(seed: int, sightings: int) -> Memory:
    """Meet NOVEL invented buildings of a town, then see each up to `sightings` times."""
    poses = _first_and_again(sightings)

    with drawn(seed, KINDS, poses, NOVEL) as (place, camera, scenes):
        pipeline = PerceptionPipeline(camera)
        meetings = []

        for scene in scenes:
            result = pipeline.process(scene.left, scene.right)
            percepts = claims(result.percepts.objects, scene.label.shape)
            seen = _sight(percepts, place, scene)
            from_where = side_and_range(place, scene.pose)
            meetings.append(Meeting(seen, from_where))

    return remembered(meetings[:NOVEL], meetings[NOVEL:], TRAINED)


def _first_and_again(sightings: int) -> Poses:
    """One pose that meets each of NOVEL buildings, and then up to `sightings` others of each."""

    def poses(place: Town, rng: np.random.Generator) -> list[Pose]:
        first = [encounter(place, target, rng) for target in range(NOVEL)]
        targets = np.repeat(np.arange(NOVEL), sightings)
        order = rng.permutation(targets)
        again = []

        for target in order.tolist():
            pose = later(place, target, first[target], rng)
            if pose is not None:
                again.append(pose)

        return first + again

    return poses


def _sight(made: Sequence[Claim], place: Town, scene: Scene) -> Sight:
    kinds = [plot.kind.name for plot in place.plots]
    _, range_m = side_and_range(place, scene.pose).T
    return sight(made, scene.label, kinds, range_m.tolist())
