"""The measurement model: how likely what is seen of landmarks is at each sample of the self
(paper §5.4, eq. 1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import NEVER_NS, Object, object_id
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.localization.motion_model import RANGE

# A landmark informs whose position is known to this, as a standard deviation, and to this share of
# its distance. Half of the first or twice moved no error by more than 1 % on two towns and two
# cities from seed 9901 on.
LARGEST_SD_M = 4.0
MAX_SD_SHARE = 0.5
# One sighting may have had another's name.
MIN_SIGHTINGS = 2
# The distance up to which a landmark may stand that is seen by its bearing alone: no building is
# recognised from farther.
FARTHEST_M = 50.0
# A percept farther from what a sample predicts does not fit it, in standard deviations: of normal
# errors one in 3,000 is in bearing and range, one in 16,000 in one of them alone.
GATE = 4.0
# The share of percepts that may be of another landmark: those that are as good as sure.
OUTLIER_SHARE = 1e-3
# The certainty of a percept that is as good as sure to be of its landmark.
SURE = 0.9
FULL_TURN_RAD = np.float32(2 * np.pi)
# Beyond this squared distance densities would be denormal numbers, with which everything is slow.
MAX_MAHALANOBIS2 = np.float32(150.0)


class Measurements(NamedTuple):
    """k known landmarks in view: where each is believed to be and where it is seen.

    `mean_m` (k, 2) and `covariance_m2` (k, 2, 2) are of the landmark on the map; the rest, (k,)
    each, of the percept; `certainty` is how likely it is of that landmark. A bearing is
    unknown if its standard deviation is at least a half turn, a range if it is at least the
    range.
    """

    labels: tuple[str, ...]
    mean_m: Floats
    covariance_m2: Floats
    bearing_rad: Floats
    range_m: Floats
    bearing_sd_rad: Floats
    range_sd_m: Floats
    certainty: Floats

    def select(self, number: int) -> Measurements:
        """Return one landmark alone."""
        chosen = slice(number, number + 1)
        return Measurements._make(values[chosen] for values in self)

    @property
    def weights(self) -> Floats:
        """Return how much each counts for or against a pose that it fits or does not fit, (k,), 0
        to 1: the logarithm of how likely it is of another landmark, over that of a sure one.
        """
        doubts = 1 - self.certainty.clip(0.0, SURE)
        weights: Floats = np.log(doubts) / np.log(1 - SURE)
        return weights

    @property
    def has_bearing(self) -> Booleans:
        """Return whether the bearing of each is known, (k,)."""
        return self.bearing_sd_rad < np.pi

    @property
    def has_range(self) -> Booleans:
        """Return whether the range of each is known, (k,)."""
        return self.range_sd_m < self.range_m


class Comparison(NamedTuple):
    """How well n samples of the self explain k landmarks in view, (k, n) each, single precision.

    `squared` is the squared Mahalanobis distance; `density` is relative to that of an exact match
    with a landmark whose position is certain.
    """

    squared: Singles
    density: Singles


def compare(samples: Floats, seen: Measurements) -> Comparison:
    """Compare (n, 7) samples of the self with what is seen.

    The uncertainty of a landmark's own position is carried to its range and bearing once, at the
    mean position of the samples.
    """
    weights = np.full(len(samples), 1 / len(samples))
    offset_m = seen.mean_m - weights @ samples[:, :2]
    squared_m2 = np.maximum((offset_m**2).sum(axis=1), 1e-6)
    total = np.trace(seen.covariance_m2, axis1=1, axis2=2)
    radial = np.einsum("ka,kab,kb->k", offset_m, seen.covariance_m2, offset_m) / squared_m2
    tangential = np.maximum(total - radial, 0.0)
    bearing_var = seen.bearing_sd_rad**2 + tangential / squared_m2
    range_var = seen.range_sd_m**2 + radial

    # Squared Mahalanobis distances, computed in place, for they take most of an update.
    east_m = _single(seen.mean_m[:, 0, None] - samples[:, 0])
    north_m = _single(seen.mean_m[:, 1, None] - samples[:, 1])

    bearing = np.arctan2(north_m, east_m)
    bearing -= _single(samples[:, 2])
    bearing -= _single(seen.bearing_rad)[:, None]
    bearing -= FULL_TURN_RAD * np.rint(bearing / FULL_TURN_RAD)
    bearing *= bearing
    bearing *= _single(seen.has_bearing / bearing_var)[:, None]

    east_m *= east_m
    north_m *= north_m
    distance = np.sqrt(np.add(east_m, north_m, out=east_m), out=east_m)
    distance *= _single(1 + samples[:, RANGE])
    distance -= _single(seen.range_m)[:, None]
    distance *= distance
    distance *= _single(seen.has_range / range_var)[:, None]

    squared = np.add(bearing, distance, out=distance)
    density = np.exp(np.minimum(squared, MAX_MAHALANOBIS2) / -2)

    # A landmark of uncertain position is seen with a flatter density.
    peak = np.where(seen.has_bearing, seen.bearing_sd_rad**2 / bearing_var, 1.0)
    peak *= np.where(seen.has_range, seen.range_sd_m**2 / range_var, 1.0)
    density *= _single(np.sqrt(peak))[:, None]
    return Comparison(squared, density)


def _single(numbers: Floats) -> Singles:
    return numbers.astype(np.float32)


def log_likelihood(density: Singles, weights: Floats | None = None) -> Floats:
    """Compute the logarithm of the product over landmarks of p(o_j | l_j, x), (n,), from (k, n)
    densities (eq. 1), each to the power of its weight (k,), or of 1.

    OUTLIER_SHARE of the percepts may mean anything, so that a landmark taken for another does not
    outvote the rest.
    """
    terms = np.log((1 - OUTLIER_SHARE) * density + OUTLIER_SHARE)
    if weights is not None:
        terms *= _single(weights)[:, None]
    return np.asarray(terms.sum(axis=0), np.float64)


def cost_of_mistake() -> float:
    """Return by how much one landmark that is taken for another lowers `log_likelihood` at most."""
    return -math.log(OUTLIER_SHARE)


def measurements(
    percepts: Iterable[Percept],
    graph: Graph,
    stationary_since_ns: int,
    min_sightings: int = MIN_SIGHTINGS,
) -> Measurements | None:
    """Choose the percepts whose object on the map is known well enough to inform; None without any.

    The object must be known to LARGEST_SD_M, and to half of its distance: samples on a ring
    around the agent have their mean where nothing is. It must also have been seen at least
    `min_sightings` times, since a first sighting may have had another's name, and not from where
    the agent has stood since `stationary_since_ns`: the same view again is no new evidence.
    """
    chosen: list[Percept] = []
    means_m = []
    covariances_m2 = []
    for percept in percepts:
        node = graph.get(Object, object_id(percept.label))
        if node is None or not (node.surveyed or node.sightings >= min_sightings):
            continue
        if is_seen_from_here(node, stationary_since_ns):
            continue

        samples = node.positions_m()
        mean_m = np.full(len(samples), 1 / len(samples)) @ samples
        offset_m = samples - mean_m
        covariance_m2 = offset_m.T @ offset_m / max(1, len(samples) - 1)

        limit_m = LARGEST_SD_M
        if percept.has_range:
            limit_m = min(limit_m, MAX_SD_SHARE * percept.range_m)
        if float(covariance_m2[0, 0] + covariance_m2[1, 1]) <= 2 * limit_m**2:
            chosen.append(percept)
            means_m.append(mean_m)
            covariances_m2.append(covariance_m2)

    if not chosen:
        return None

    return Measurements(
        labels=tuple(percept.label for percept in chosen),
        mean_m=np.array(means_m),
        covariance_m2=np.array(covariances_m2),
        bearing_rad=np.array([percept.bearing_rad for percept in chosen]),
        range_m=np.array([percept.range_m for percept in chosen]),
        bearing_sd_rad=np.array([percept.bearing_sd_rad for percept in chosen]),
        range_sd_m=np.array([percept.range_sd_m for percept in chosen]),
        certainty=np.array([percept.certainty for percept in chosen]),
    )


def is_seen_from_here(node: Object, stationary_since_ns: int) -> bool:
    """Return whether an agent that stands since `stationary_since_ns` has seen the landmark from
    where it stands.
    """
    is_stationary = stationary_since_ns != NEVER_NS
    return is_stationary and node.last_seen_ns >= stationary_since_ns
