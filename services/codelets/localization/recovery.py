"""Relocalization of a kidnapped agent: it may be wherever the landmarks in view look as they do."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.geometry.se2 import compose, relative
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.schemas.nodes import PathSegment, segment_id
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.localization.measurement_model import (
    FARTHEST_M,
    GATE,
    MAX_SD_SHARE,
    Measurements,
    compare,
    log_likelihood,
)
from cogmap.services.codelets.localization.motion_model import COLUMNS, RANGE
from cogmap.services.codelets.localization.sampling import position_sd_m
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import ODOMETRY, STAMP, objects_along

# Tried for each sample that is drawn.
CANDIDATES = 16
# A pose is accepted that so many landmarks fit, and such a share of those in view.
MIN_FITTING = 2
FITTING_SHARE = 2 / 3
# A landmark counts as a whole whose position has at most this standard deviation.
SURE_M = 1.0
# The error of path integration since a landmark was seen, as a share of the distance.
DRIFT_SHARE = 0.05


def seen_before(graph: Graph, odometry: Floats, since_ns: float) -> list[Percept]:
    """Return the landmarks that were seen after `since_ns`, as they would be in view now, each as
    it was seen last, from the newest two segments of the path.

    By path integration alone, the agent is at `odometry` (3,).
    """
    last = graph.last_segment
    if last is None:
        return []

    before = graph.get(PathSegment, segment_id(last.number - 1))
    segments = [last] if before is None else [before, last]
    rows = rows_of(segments)
    rows = rows[rows[:, STAMP] > since_ns * 1e-9]

    observations = []
    for segment in segments:
        observations += [each for each, _ in objects_along(graph, segment)]
    seen = Sightings.of(observations, rows[:, STAMP])

    latest = {}
    for index, landmark in enumerate(seen.landmark.tolist()):
        latest[seen.labels[landmark]] = index

    percepts = []
    for label, index in latest.items():
        then = rows[seen.place[index], ODOMETRY]
        step = np.append(seen.where_m[index], 0.0)
        forwards_m, left_m, _ = relative(odometry, compose(then, step)).tolist()

        # It is as certain as when it was seen, and the less so the farther the agent went since.
        variance_m2 = float(np.linalg.eigvalsh(np.linalg.inv(seen.information[index])).max())
        drift_m = DRIFT_SHARE * float(np.hypot(*(then - odometry)[:2]))
        sd_m = math.sqrt(variance_m2 + drift_m**2)
        range_m = max(math.hypot(forwards_m, left_m), 1e-3)
        percept = Percept(
            label=label,
            activation=1.0,
            evidence=0.0,
            bearing_rad=math.atan2(left_m, forwards_m),
            range_m=range_m,
            bearing_sd_rad=min(sd_m / range_m, math.pi),
            range_sd_m=sd_m,
            width_m=0.0,
            height_m=0.0,
            whole=bool(seen.whole[index]),
            box_px=(0, 0, 0, 0),
        )
        percepts.append(percept)

    return percepts


def relocalize(gains: Floats, seen: Measurements, rng: np.random.Generator) -> Floats:
    """Draw (n, 7) samples of the self by what is in view alone; the senses' gains are those of
    (n, 7) `gains`.

    Each candidate stands on a circle around one of the landmarks, turned to see it as it is seen,
    and is drawn with the likelihood of all others in view. One landmark gives a ring, of which the
    next ones leave parts.
    """
    number = len(gains) * CANDIDATES
    candidates = np.empty((number, COLUMNS))
    candidates[:] = np.tile(gains, (CANDIDATES, 1))
    which = rng.integers(len(seen.labels), size=number)
    direction_rad = rng.uniform(-np.pi, np.pi, number)

    # A square root of each covariance, which may be singular.
    values, vectors = np.linalg.eigh(seen.covariance_m2)
    root_m = (vectors * np.sqrt(values.clip(0.0))[:, None, :])[which]
    drawn = rng.normal(0.0, 1.0, (number, 2))
    landmark_m = seen.mean_m[which] + np.einsum("nij,nj->ni", root_m, drawn)

    measured_m = rng.normal(seen.range_m[which], seen.range_sd_m[which])
    near_m = measured_m / (1 + candidates[:, RANGE])
    any_m = rng.uniform(0.0, FARTHEST_M, number)
    distance_m = np.where(seen.has_range[which], near_m, any_m).clip(0.0)
    candidates[:, 0] = landmark_m[:, 0] + distance_m * np.cos(direction_rad)
    candidates[:, 1] = landmark_m[:, 1] + distance_m * np.sin(direction_rad)

    measured_rad = rng.normal(seen.bearing_rad[which], seen.bearing_sd_rad[which])
    any_rad = rng.uniform(-np.pi, np.pi, number)
    bearing_rad = np.where(seen.has_bearing[which], measured_rad, any_rad)
    candidates[:, 2] = direction_rad + np.pi - bearing_rad

    density = compare(candidates, seen).density
    density[which, np.arange(number)] = 1.0  # it was drawn by that one
    return _drawn(candidates, density, len(gains), rng)


def best_of(
    samples: Floats, seen: Measurements, is_unsure: bool, min_fitting: int
) -> Floats | None:
    """Choose those of relocalization's (n, 7) samples at which the agent is taken to be; None if it
    is at none.

    Most landmarks must fit one of them together, each by how certain its name is. An agent that was
    sure to be elsewhere is where most of all fit, if that is one place, and at least `min_fitting`
    landmarks fit there. A landmark whose own place is not sure counts for half: two of those nearly
    always fit somewhere.
    """
    weights = seen.weights
    is_fitting = compare(samples, seen).squared < GATE**2
    fitting = weights @ is_fitting
    best = fitting.argmax()
    if fitting[best] < FITTING_SHARE * weights.sum():
        return None
    if is_unsure:
        return samples

    variance_m2 = np.trace(seen.covariance_m2, axis1=1, axis2=2) / 2
    weights *= np.where(variance_m2 <= SURE_M**2, 1.0, 0.5)
    if weights[is_fitting[:, best]].sum() < min_fitting:
        return None

    there = samples[np.isclose(fitting, fitting[best])]
    limit_m = MAX_SD_SHARE * float(seen.range_m.min())
    return there if position_sd_m(there) <= limit_m else None


def relocalize_heading(samples: Floats, seen: Measurements, rng: np.random.Generator) -> Floats:
    """Draw (n, 7) samples of the self, its position known, its heading unknown: turn them by what
    is in view.

    Each candidate stands as one of `samples`, turned to see one of the landmarks as it is seen, and
    is drawn with the likelihood of all that is in view but that one's bearing.
    """
    candidates = np.tile(samples, (CANDIDATES, 1))
    number = len(candidates)
    with_bearing = np.flatnonzero(seen.has_bearing)
    which = rng.choice(with_bearing, size=number)

    offset_m = seen.mean_m[which] - candidates[:, :2]
    direction_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0])
    drawn = rng.normal(0.0, 1.0, number)
    bearing_rad = seen.bearing_rad[which] + drawn * seen.bearing_sd_rad[which]
    candidates[:, 2] = direction_rad - bearing_rad

    density = compare(candidates, seen).density
    density[which, np.arange(number)] *= np.exp(drawn**2 / 2)  # it was turned by that one's bearing
    return _drawn(candidates, density, len(samples), rng)


def _drawn(candidates: Floats, density: Singles, count: int, rng: np.random.Generator) -> Floats:
    """Draw `count` of (n, 7) candidates by the (k, n) densities of the landmarks in view."""
    scores = log_likelihood(density)
    weights = np.exp(scores - scores.max())
    probabilities = weights / weights.sum()
    chosen = rng.choice(len(candidates), size=count, p=probabilities)
    return candidates[chosen]
