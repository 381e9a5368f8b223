"""The metrics of perception in held-out towns, which processes draw and look at."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from benchmarks.perception import objects, road, sequence, streets
from benchmarks.perception.novel import Meeting, Memory, Strangers, remembered
from benchmarks.perception.objects import Claim, Sight
from benchmarks.perception.pipeline import PERIOD_S, CandidateProbe, PerceptionPipeline
from benchmarks.perception.scenes import (
    FARTHEST_M,
    FIRST_SEED,
    NEAREST_M,
    Poses,
    Scene,
    anywhere,
    drawn,
    drive,
    encounter,
    later,
    side_and_range,
)
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.cli.progress import bar
from cogmap.geometry.arrays import Floats, Singles
from cogmap.parallel import parallel_map
from cogmap.schemas.sensing import Pose
from cogmap.services.epam.public import road as road_network
from cogmap.services.sim.public import CATALOGUE, STREET_WIDTH_M, town
from cogmap.training.rendering.towns import KINDS

THRESHOLDS = {
    "top1": at_least(0.97),
    "ece": at_most(0.05),
    "detect_recall": at_least(0.95),
    "detect_precision": at_least(0.95),
    "novel_top1": at_least(0.85),
    "novel_wrong_merges": at_most(0.02),
    "road_iou": at_least(0.93),
    "road_edge_error_m": at_most(0.25),
    "depth_error": at_most(0.04),
    "sequence_recall_at_99p": at_least(0.80),
    "frame_ms_p50": at_most(40),
    "frame_ms_p99": at_most(60),
}
PROCESSES = 2
# Of each town, up to how many of its kinds are invented.
TOWNS = (0, 0, 14, 0, 0, 14, 0, 0)
VIEWS = 90
TRAINED = frozenset(kind.name for kind in CATALOGUE)

NOVEL_TOWNS = 3
NOVEL = 20
SIGHTINGS = 7

FRAMES = 150
WARM_UP_FRAMES = 20
FRAME_STEP_M = 0.3

RANGES_M = ((5.0, 15.0), (15.0, 30.0), (30.0, 60.0))
LARGER_SHARE = 0.03
# Depth is compared within these limits, and the error of one pixel in EVERY is kept.
DEPTHS_M = (3.0, 30.0)
EVERY = 16


def measure() -> Metrics:
    """Return the metrics of THRESHOLDS, and others that explain them."""
    # Each process is on a core of its own: no library should start threads.
    os.environ.update(OMP_NUM_THREADS="1", LP_NUM_THREADS="1")

    # The longest come first: places by sequence, then the towns of novel buildings.
    jobs: list[Callable[[], Any]] = [sequence.measure]
    for number in range(NOVEL_TOWNS):
        jobs.append(partial(measure_novel, FIRST_SEED + len(TOWNS) + number, SIGHTINGS))
    for seed, invented in enumerate(TOWNS, start=FIRST_SEED):
        jobs.append(partial(measure_town, seed, invented, VIEWS))

    with bar("held-out towns") as progress:
        places, *found = parallel_map(_call, jobs, PROCESSES, progress)

    memory = sum(found[:NOVEL_TOWNS], Memory())
    later_sightings = max(1, memory.later)
    recognised_again = {
        "novel_top1": memory.right / later_sightings,
        "novel_buildings": float(memory.met),
        "novel_sightings": float(memory.later),
        "novel_wrong_merges": memory.merges / later_sightings,
        "novel_splits": float(memory.splits),
        "novel_as_trained": float(memory.mistaken),
    }

    metrics: Metrics = places | seen(found[NOVEL_TOWNS:]) | recognised_again
    times_ms = frame_times_ms(FIRST_SEED, FRAMES)
    return metrics | {
        "frame_ms_p50": float(np.percentile(times_ms, 50)),
        "frame_ms_p99": float(np.percentile(times_ms, 99)),
    }


def _call(job: Callable[[], Any]) -> Any:
    return job()


@dataclass(frozen=True, eq=False)
class TownResult:
    """One town: the sights of its buildings, `judged` pairs of activation and rightness.

    Errors are of each point of the road's edge, and of the depth of one pixel in EVERY.
    """

    sights: list[Sight]
    judged: list[tuple[float, bool]]
    road_iou: float
    edge_errors_m: Floats
    edges_missed_m: Floats
    depth_errors: Singles
    depth_known: float


def measure_town(seed: int, invented: int, views: int) -> TownResult:
    """Look at the town of `seed` from `views` places; nothing was learned before."""
    roads = road_network.load()
    probe = CandidateProbe()
    sights = []
    candidates = []
    masks = []
    surfaces = []
    edge_errors_m = []
    edges_missed_m = []
    depths = []

    with drawn(seed, invented, anywhere(views)) as (place, camera, scenes):
        pipeline = PerceptionPipeline(camera)
        edges = streets.edges([street.area(STREET_WIDTH_M / 2) for street in place.roads])

        for scene in scenes:
            result = pipeline.process(scene.left, scene.right)
            percepts = objects.claims(result.percepts.objects, scene.label.shape)
            sights.append(_sight(percepts, place, scene))
            candidates.append(_sight(probe.candidates(result), place, scene))

            image = result.view.image.numpy()
            masks.append(roads.mask(image.astype(np.uint8, copy=False)))
            surfaces.append(scene.surface)

            boundary_m = result.percepts.road_boundary_m.numpy()
            in_town_m = streets.in_town(boundary_m, scene.pose)
            edge_errors_m.append(streets.distances_m(in_town_m, edges))
            edges_missed_m.append(
                road.road_edges_missed_m(boundary_m, scene.surface, scene.depth_m, camera)
            )

            found_m = result.view.depth_m.numpy()
            depths.append(depth_errors(found_m.astype(np.float32, copy=False), scene.depth_m))

    return TownResult(
        sights=sights,
        judged=objects.right_or_not(candidates, sights, TRAINED),
        road_iou=road.road_iou(np.asarray(masks), np.asarray(surfaces)),
        edge_errors_m=np.concatenate(edge_errors_m),
        edges_missed_m=np.concatenate(edges_missed_m),
        depth_errors=np.concatenate([relative[::EVERY] for relative, _ in depths]),
        depth_known=float(np.mean([known for _, known in depths])),
    )


def measure_novel(seed: int, sightings: int) -> Memory:
    """Meet NOVEL invented buildings of a town, then see each up to `sightings` times."""
    with drawn(seed, KINDS, _first_and_again(sightings), NOVEL) as (place, camera, scenes):
        pipeline = PerceptionPipeline(camera)
        strangers = Strangers()
        meetings = []

        for scene in scenes:
            result = pipeline.process(scene.left, scene.right)
            named = strangers.named(result.percepts.objects, scene.label.size)
            percepts = objects.claims(named, scene.label.shape)
            from_where = side_and_range(place, scene.pose)
            meetings.append(Meeting(_sight(percepts, place, scene), from_where))

    return remembered(meetings[:NOVEL], meetings[NOVEL:], TRAINED)


def _first_and_again(sightings: int) -> Poses:
    """Draw one pose that meets each of NOVEL buildings, then up to `sightings` others of each."""

    def poses(place: town.Town, rng: np.random.Generator) -> list[Pose]:
        first = [encounter(place, target, rng) for target in range(NOVEL)]
        targets = np.repeat(np.arange(NOVEL), sightings)
        again = []

        for target in rng.permutation(targets).tolist():
            pose = later(place, target, first[target], rng)
            if pose is not None:
                again.append(pose)

        return first + again

    return poses


def _sight(made: Sequence[Claim], place: town.Town, scene: Scene) -> Sight:
    kinds = [plot.kind.name for plot in place.plots]
    _, range_m = side_and_range(place, scene.pose).T
    return objects.sight(made, scene.label, kinds, range_m.tolist())


def depth_errors(depth_m: Singles, true_m: Singles) -> tuple[Singles, float]:
    """Return the relative errors (n,) of known depths within DEPTHS_M, and the share of the pixels
    within these limits of which depth is known.
    """
    min_m, max_m = DEPTHS_M
    is_within = (true_m >= min_m) & (true_m <= max_m)
    is_known = is_within & (depth_m > 0)

    known_m = true_m[is_known]
    relative = np.abs(depth_m[is_known] - known_m) / known_m
    share = is_known.sum() / max(1, is_within.sum())
    return relative.astype(np.float32, copy=False), float(share)


def frame_times_ms(seed: int, frames: int) -> list[float]:
    """Return the times from stereo pairs to percepts of so many `frames` of a drive through the
    town of `seed`, after a few to warm up.
    """
    length_m = (WARM_UP_FRAMES + frames) * FRAME_STEP_M
    with drawn(seed, 0, drive(length_m, FRAME_STEP_M)) as (_, camera, scenes):
        pairs = [(scene.left, scene.right) for scene in scenes]

    pipeline = PerceptionPipeline(camera)
    speed_m_s = FRAME_STEP_M / PERIOD_S
    took_ms = [pipeline.process(left, right, speed_m_s).took_ms for left, right in pairs]
    return took_ms[WARM_UP_FRAMES:]


def seen(results: Sequence[TownResult]) -> Metrics:
    """Return the metrics of buildings, roads and depth in all towns together."""
    sights: list[Sight] = []
    judged: list[tuple[float, bool]] = []
    for result in results:
        sights += result.sights
        judged += result.judged

    # Of segments of trained kinds, in all and by distance.
    right = objects.named(sights, TRAINED, NEAREST_M, FARTHEST_M)
    metrics = {
        "top1": _share(right),
        "top1_segments": float(len(right)),
    }
    for min_m, max_m in RANGES_M:
        right_there = objects.named(sights, TRAINED, min_m, max_m)
        metrics[f"top1_{min_m:g}_{max_m:g}m"] = _share(right_there)

    found, there, matched, claimed = objects.detection(sights)
    found_large, there_large, _, _ = objects.detection(sights, LARGER_SHARE)
    depths = np.concatenate([result.depth_errors for result in results])

    return metrics | {
        "ece": objects.calibration_error(judged),
        "detect_recall": found / max(1, there),
        "detect_precision": matched / max(1, claimed),
        "detect_buildings": float(there),
        "detect_segments": float(claimed),
        "detect_recall_3_percent": found_large / max(1, there_large),
        "road_iou": float(np.mean([result.road_iou for result in results])),
        "road_edge_error_m": road.road_edge_error_m([each.edge_errors_m for each in results]),
        "road_edge_missed_m": road.road_edge_error_m([each.edges_missed_m for each in results]),
        "depth_error": float(np.median(depths)),
        "depth_known": float(np.mean([result.depth_known for result in results])),
    }


def _share(right: Sequence[bool]) -> float:
    return sum(right) / max(1, len(right))
