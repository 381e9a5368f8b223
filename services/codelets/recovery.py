"""Where an agent may be that was carried away: anywhere from where the landmarks in view look as they do."""

from __future__ import annotations

import numpy as np

from services.codelets.sampling import Samples
from services.codelets.senses import COLUMNS, RANGE
from services.codelets.settings import Config
from services.codelets.sightings import Sighting, compare, log_likelihood

CANDIDATES = 16


def look_around(gains: Samples, seen: Sighting, config: Config, rng: np.random.Generator) -> Samples:
    """(n, 7) samples of the self by what is in view alone; the senses' gains are those of (n, 7) `gains`.

    Each candidate stands on a circle around one of the landmarks, turned to see it as it is seen, and is drawn with
    the likelihood of all others in view. One landmark gives a ring, which the next ones break.
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
    distance = np.where(seen.has_range[which], near, rng.uniform(0.0, config.farthest_m, number)).clip(0.0)
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


def _roots(covariances: Samples) -> Samples:
    """A square root of each (k, 2, 2) covariance, which may be singular."""
    values, vectors = np.linalg.eigh(covariances)
    roots: Samples = vectors * np.sqrt(values.clip(0.0))[:, None, :]
    return roots
