"""The localization codelet: where the agent is, and where each landmark it sees is (paper §5.4, eq. 1-4).

Recursive Bayes by rejection sampling: samples move with the self-motion, and stay with a probability
proportional to the likelihood of what is seen. Its cost grows with the landmarks in view, not on the map.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bus.errors import MessageError
from bus.graph import nearest_place
from schemas.array import Array
from schemas.graph import DropLink, Link, Node, Operation
from schemas.mind import Task
from schemas.sensing import Percept
from services.codelets.sampling import Samples, generator, keep, mean_pose, refill, spread, wrapped
from services.codelets.settings import Config

ROUNDS = 8


class Sighting(NamedTuple):
    """A landmark in view, as arrays over those seen: where it is believed and where it is seen."""

    mean_m: Samples
    covariance_m2: Samples
    bearing_rad: Samples
    range_m: Samples
    bearing_sd_rad: Samples
    range_sd_m: Samples


def move(start: Samples, motions: Samples, rng: np.random.Generator) -> Samples:
    """Path integration (paper §5.4): (n, 3) poses after (m, 5) rows of speed, turn rate, duration and noise."""
    poses = start.copy()
    for speed, turn_rate, dt, speed_sd, turn_rate_sd in motions:
        way = dt * rng.normal(speed, speed_sd, len(poses))
        turn = dt * rng.normal(turn_rate, turn_rate_sd, len(poses))
        poses[:, 0] += way * np.cos(poses[:, 2] + turn / 2)
        poses[:, 1] += way * np.sin(poses[:, 2] + turn / 2)
        poses[:, 2] += turn
    return poses


def log_likelihood(poses: Samples, seen: Sighting, outlier: float) -> Samples:
    """log of the product over landmarks of p(o_j | l_j, x) at each of (n, 3) poses (eq. 1).

    `outlier` is the share of sightings that may mean anything: a landmark taken for another outvotes nobody.
    """
    offset = seen.mean_m[None, :, :] - poses[:, None, :2]
    distance = np.hypot(offset[..., 0], offset[..., 1]).clip(1e-3)
    radial = offset / distance[..., None]
    radial_var = np.einsum("njk,jkl,njl->nj", radial, seen.covariance_m2, radial)
    trace = np.trace(seen.covariance_m2, axis1=1, axis2=2)
    bearing_var = seen.bearing_sd_rad**2 + (trace - radial_var).clip(0) / distance**2
    range_var = seen.range_sd_m**2 + radial_var
    bearing_off = wrapped(np.arctan2(offset[..., 1], offset[..., 0]) - poses[:, 2:3] - seen.bearing_rad)
    squared = bearing_off**2 / bearing_var + (distance - seen.range_m) ** 2 / range_var
    density = np.exp(-squared / 2) / np.sqrt(bearing_var * range_var)
    reference = 1 / (seen.bearing_sd_rad * seen.range_sd_m)
    result: Samples = np.log((1 - outlier) * density / reference + outlier).sum(axis=1)
    return result


def sightings(task: Task, largest_sd_m: float) -> Sighting | None:
    """The percepts of `task` whose object is on the map well enough to tell something; None if there are none."""
    known = {node.attributes.get("label"): node for node in task.nodes if node.kind == "object"}
    rows = []
    for percept in task.percepts:
        node = known.get(percept.label)
        if node is None or node.samples is None:
            continue
        samples = np.asarray(node.samples.numpy(), np.float64)
        covariance = np.cov(samples[:, :2], rowvar=False)
        if np.trace(covariance) <= 2 * largest_sd_m**2:
            rows.append((samples[:, :2].mean(axis=0), covariance, percept))
    if not rows:
        return None
    means, covariances, percepts = zip(*rows, strict=True)
    numbers = [(p.bearing_rad, p.range_m, p.bearing_sd_rad, p.range_sd_m) for p in percepts]
    return Sighting(np.array(means), np.array(covariances), *np.array(numbers).T)


def localize(task: Task, config: Config) -> list[Operation]:
    """Move the self node's samples, correct them by the landmarks in view, and link it to its new place.

    Where the paper starts each step from the mean of the samples, these go on from the samples themselves: what
    the agent does not know of its heading now, it must still not know when it comes to matter.
    """
    self_node = next((node for node in task.nodes if node.kind == "self"), None)
    if self_node is None or self_node.samples is None:
        raise MessageError(f"task {task.task_id} has no self node with samples")
    rng = generator(task.task_id)
    before = np.array(self_node.samples.numpy(), np.float64)
    start = refill(before, config.samples, 0.0, rng)
    motions = np.asarray(task.motions.numpy(), np.float64)
    seen = sightings(task, config.largest_landmark_sd_m)
    if seen is None or not motions[:, 0].any():
        kept, share = move(start, motions, rng), 1.0
    else:
        kept, share = _correct(start, motions, seen, config, rng)
    return _self_operations(task, self_node, kept, share)


def _correct(
    start: Samples, motions: Samples, seen: Sighting, config: Config, rng: np.random.Generator
) -> tuple[Samples, float]:
    """Move and reject until enough samples are kept, or rounds run out; the share that was kept."""
    poses, scores = np.empty((0, 3)), np.empty(0)
    for _ in range(ROUNDS):
        moved = move(start, motions, rng)
        poses = np.vstack([poses, moved])
        scores = np.append(scores, log_likelihood(moved, seen, config.outlier_share) / config.views_alike)
        kept = keep(scores, rng)
        if kept.sum() >= config.kept_samples:
            break
    return poses[kept], float(kept.mean())


def _self_operations(task: Task, node: Node, kept: Samples, share: float) -> list[Operation]:
    mean = mean_pose(kept)
    sd = spread(kept, mean)
    cell = nearest_place(mean[0], mean[1], task.cell_m)
    attributes = node.attributes | {
        "x_m": float(mean[0]),
        "y_m": float(mean[1]),
        "heading_rad": float(mean[2]),
        "x_sd_m": float(sd[0]),
        "y_sd_m": float(sd[1]),
        "heading_sd_rad": float(sd[2]),
        "kept_share": share,
        "stamp_ns": task.stamp_ns,
        "place": cell,
    }
    moved = Node(
        id=node.id, kind=node.kind, activation=1.0, base_level=1.0, attributes=attributes, samples=Array.of(kept)
    )
    return [moved, *place_link(node, cell)]


def place_link(node: Node, cell: str) -> list[Operation]:
    """The link of a node to its place, in place of the one it had."""
    old = str(node.attributes.get("place", ""))
    dropped: list[Operation] = [DropLink(source=node.id, target=old)] if old and old != cell else []
    return [*dropped, Link(source=node.id, target=cell)]


def locate_landmark(task: Task, config: Config) -> list[Operation]:
    """Eq. 4 for the one landmark and percept of `task`: keep the samples that agree with what is seen now.

    A landmark that disagrees `config.misses` times on end stands elsewhere: it starts anew from what is seen.
    """
    self_node = next(node for node in task.nodes if node.kind == "self")
    landmark = next(node for node in task.nodes if node.kind == "object")
    if self_node.samples is None or landmark.samples is None:
        raise MessageError(f"task {task.task_id} has nodes without samples")
    rng, percept = generator(task.task_id), task.percepts[0]
    before = np.array(landmark.samples.numpy(), np.float64)
    poses = refill(np.array(self_node.samples.numpy(), np.float64), len(before), 0.0, rng)
    offset = before - poses[:, :2]
    distance = np.hypot(offset[:, 0], offset[:, 1]).clip(1e-3)
    off = wrapped(np.arctan2(offset[:, 1], offset[:, 0]) - poses[:, 2] - percept.bearing_rad)
    squared = (off / percept.bearing_sd_rad) ** 2 + ((distance - percept.range_m) / percept.range_sd_m) ** 2
    misses = 0 if squared.min() < config.gate**2 else int(landmark.attributes.get("misses", 0)) + 1
    if misses == 0:
        kept = before[keep(-squared / 2 / config.views_alike, rng)]
        kept = refill(kept, len(before), config.landmark_jitter_m, rng)
    elif misses < config.misses:
        kept = before
    else:
        kept, misses = first_sighting(poses, percept, rng), 0
    return object_operations(task, landmark, kept, percept, misses)


def first_sighting(poses: Samples, percept: Percept, rng: np.random.Generator) -> Samples:
    """Where something may be that is seen from (n, 3) poses for the first time: (n, 2) samples."""
    bearing = poses[:, 2] + rng.normal(percept.bearing_rad, percept.bearing_sd_rad, len(poses))
    distance = rng.normal(percept.range_m, percept.range_sd_m, len(poses)).clip(0.1)
    where: Samples = poses[:, :2] + distance[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
    return where


def object_operations(task: Task, node: Node, samples: Samples, percept: Percept, misses: int) -> list[Operation]:
    """An object node with new samples, refreshed by a percept, and its link to the place of their mean."""
    mean = samples.mean(axis=0)
    sd = spread(samples, mean)
    cell = nearest_place(mean[0], mean[1], task.cell_m)
    attributes = node.attributes | {
        "x_m": float(mean[0]),
        "y_m": float(mean[1]),
        "x_sd_m": float(sd[0]),
        "y_sd_m": float(sd[1]),
        "width_m": percept.width_m,
        "height_m": percept.height_m,
        "sightings": int(node.attributes.get("sightings", 0)) + 1,
        "misses": misses,
        "stamp_ns": task.stamp_ns,
        "place": cell,
    }
    seen = Node(
        id=node.id,
        kind="object",
        activation=percept.activation,
        base_level=min(1.0, node.base_level + 0.05),
        attributes=attributes,
        samples=Array.of(samples),
    )
    return [seen, *place_link(node, cell)]
