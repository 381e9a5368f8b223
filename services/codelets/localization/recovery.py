"""Where an agent may be that was carried away: anywhere from where the landmarks that it sees look
as they do.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.se2 import compose, relative
from cogmap.graph.graph import Graph
from schemas.sensing import Percept
from services.codelets.config import Config
from services.codelets.localization.measurement_model import Sighting, compare, log_likelihood
from services.codelets.localization.motion_model import COLUMNS, RANGE
from services.codelets.localization.sampling import Samples
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import ODOMETRY, STAMP, objects_along

CANDIDATES = 16
# What path integration may be off by since a landmark was seen, as a share of the way.
DRIFT_SHARE = 0.05


def seen_before(graph: Graph, odometry: Samples) -> list[Percept]:
    """Landmarks that were seen since anything last fitted, as they would be in view now, each as it
    was seen last.

    Path integration alone has the agent at `odometry` (3,).
    """
    agent = graph.agent
    last = graph.last_segment
    if agent is None or last is None:
        return []
    rows = last.rows.numpy()
    rows = rows[rows[:, STAMP] > agent.last_fit_ns * 1e-9]
    observations = [each for each, _ in objects_along(graph, last)]
    seen = Sightings.of(observations, rows[:, STAMP])

    latest = {}
    for index, landmark in enumerate(seen.landmark.tolist()):
        latest[seen.labels[landmark]] = index

    percepts = []
    for label, index in latest.items():
        then = rows[seen.place[index], ODOMETRY]
        landmark_pose = compose(then, np.append(seen.where_m[index], 0.0))
        forwards_m, left_m, _ = relative(odometry, landmark_pose).tolist()

        covariance_m2 = np.linalg.inv(seen.information[index])
        variance_m2 = float(np.linalg.eigvalsh(covariance_m2).max())
        drift_m = DRIFT_SHARE * float(np.hypot(*(then - odometry)[:2]))
        sd_m = math.sqrt(variance_m2 + drift_m**2)
        percepts.append(_percept(label, forwards_m, left_m, sd_m))
    return percepts


def _percept(label: str, forwards_m: float, left_m: float, sd_m: float) -> Percept:
    range_m = max(math.hypot(forwards_m, left_m), 1e-3)
    return Percept(
        label=label,
        activation=1.0,
        bearing_rad=math.atan2(left_m, forwards_m),
        range_m=range_m,
        bearing_sd_rad=min(sd_m / range_m, math.pi),
        range_sd_m=sd_m,
        width_m=0.0,
        height_m=0.0,
        whole=False,
        box_px=(0, 0, 0, 0),
    )


def look_around(
    gains: Samples, seen: Sighting, config: Config, rng: np.random.Generator
) -> Samples:
    """(n, 7) samples of the self by what is in view alone; the senses' gains are those of (n, 7)
    `gains`.

    Each candidate stands on a circle around one of the landmarks, turned to see it as it is seen,
    and is drawn with the likelihood of all others in view. One landmark gives a ring, which the
    next ones break.
    """
    number = len(gains) * CANDIDATES
    candidates = np.empty((number, COLUMNS))
    candidates[:] = np.tile(gains, (CANDIDATES, 1))
    which = rng.integers(len(seen.labels), size=number)
    direction = rng.uniform(-np.pi, np.pi, number)
    where = seen.mean_m[which] + np.einsum(
        "nij,nj->ni", _roots(seen.covariance_m2)[which], rng.normal(0.0, 1.0, (number, 2))
    )
    near = rng.normal(seen.range_m[which], seen.range_sd_m[which]) / (1 + candidates[:, RANGE])
    distance = np.where(
        seen.has_range[which], near, rng.uniform(0.0, config.farthest_m, number)
    ).clip(0.0)
    candidates[:, 0] = where[:, 0] + distance * np.cos(direction)
    candidates[:, 1] = where[:, 1] + distance * np.sin(direction)
    bearing = rng.normal(seen.bearing_rad[which], seen.bearing_sd_rad[which])
    turned = np.where(seen.has_bearing[which], bearing, rng.uniform(-np.pi, np.pi, number))
    candidates[:, 2] = direction + np.pi - turned
    density = compare(candidates, seen).density
    density[which, np.arange(number)] = 1.0  # it was drawn by that one
    scores = log_likelihood(density, config.outlier_share)
    chances = np.exp(scores - scores.max())
    return candidates[rng.choice(number, size=len(gains), p=chances / chances.sum())]


def turn_about(
    samples: Samples, seen: Sighting, config: Config, rng: np.random.Generator
) -> Samples:
    """(n, 7) samples of the self, who knows about where it stands but not how it is turned: turned
    by what is in view.

    Each candidate stands as one of `samples`, turned to see one of the landmarks as it is seen, and
    is drawn with the likelihood of all that is in view but that one's bearing.
    """
    candidates = np.tile(samples, (CANDIDATES, 1))
    number = len(candidates)
    which = rng.choice(np.flatnonzero(seen.has_bearing), size=number)
    off = seen.mean_m[which] - candidates[:, :2]
    drawn = rng.normal(0.0, 1.0, number)
    bearing = seen.bearing_rad[which] + drawn * seen.bearing_sd_rad[which]
    candidates[:, 2] = np.arctan2(off[:, 1], off[:, 0]) - bearing
    density = compare(candidates, seen).density
    density[which, np.arange(number)] *= np.exp(drawn**2 / 2)  # it was turned by that one's bearing
    scores = log_likelihood(density, config.outlier_share)
    chances = np.exp(scores - scores.max())
    return candidates[rng.choice(number, size=len(samples), p=chances / chances.sum())]


def _roots(covariances: Samples) -> Samples:
    """A square root of each (k, 2, 2) covariance, which may be singular."""
    values, vectors = np.linalg.eigh(covariances)
    roots: Samples = vectors * np.sqrt(values.clip(0.0))[:, None, :]
    return roots
