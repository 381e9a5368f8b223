"""The measurement model: how likely what is seen of landmarks is at each sample of the self
(paper §5.4, eq. 1).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arctangent import arctan2
from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.graph import Graph
from schemas.nodes import NEVER_NS, Object, object_id
from schemas.sensing import Percept
from services.codelets.localization.motion_model import RANGE
from services.codelets.localization.sampling import equal_weights

MAX_SD_SHARE = 0.5
MIN_SIGHTINGS = 2
FULL_TURN_RAD = np.float32(2 * np.pi)
# Beyond this squared distance densities would be denormal numbers, with which everything is slow.
MAX_MAHALANOBIS2 = np.float32(150.0)
MINUS_HALF = np.float32(-0.5)


class Sighting(NamedTuple):
    """k known landmarks in view: where each is believed to be and where it is seen.

    `mean_m` (k, 2) and `covariance_m2` (k, 2, 2) are of the landmark on the map; the rest, (k,)
    each, of the percept. A bearing is unknown where its standard deviation is at least a half turn,
    a range where it is at least the range.
    """

    labels: tuple[str, ...]
    mean_m: Floats
    covariance_m2: Floats
    bearing_rad: Floats
    range_m: Floats
    bearing_sd_rad: Floats
    range_sd_m: Floats

    @property
    def has_bearing(self) -> Booleans:
        """(k,): of which the bearing is known."""
        return self.bearing_sd_rad < np.pi

    @property
    def has_range(self) -> Booleans:
        """(k,): of which the range is known."""
        return self.range_sd_m < self.range_m


def has_bearing(percept: Percept) -> bool:
    """Whether the bearing of a percept is known."""
    return percept.bearing_sd_rad < np.pi


def has_range(percept: Percept) -> bool:
    """Whether the range of a percept is known."""
    return percept.range_sd_m < percept.range_m


class Comparison(NamedTuple):
    """How well n samples of the self explain k landmarks in view, (k, n) each, single precision.

    `squared` is the squared Mahalanobis distance; `density` is relative to that of an exact match
    with a landmark whose position is certain.
    """

    squared: Singles
    density: Singles


class Noise(NamedTuple):
    """How certain k views are, (k, 1) each, single precision: inverse variances, 0 where nothing is
    known, and the density of an exact match relative to that of a landmark of certain position.
    """

    bearing_information: Singles
    range_information: Singles
    peak: Singles


def compare(samples: Floats, seen: Sighting) -> Comparison:
    """Compare (n, 7) samples of the self with what is seen.

    The uncertainty of a landmark's own position is carried to its range and bearing once, at the
    mean position of the samples.
    """
    middle_m = equal_weights(len(samples)) @ samples[:, :2]
    offset_m = seen.mean_m - middle_m
    noise = _noise(seen, offset_m)

    # Relative to their middle, single precision is enough for positions.
    from_m = _single(samples[:, :2] - middle_m)
    to_m = _single(offset_m)
    east_m = to_m[:, :1] - from_m[:, 0]
    north_m = to_m[:, 1:] - from_m[:, 1]

    squared = _bearing_residuals(east_m, north_m, samples[:, 2], seen)
    squared *= squared
    squared *= noise.bearing_information

    range_squared = _range_residuals(east_m, north_m, samples[:, RANGE], seen)
    range_squared *= range_squared
    range_squared *= noise.range_information
    squared += range_squared

    density = np.minimum(squared, MAX_MAHALANOBIS2, out=range_squared)
    density *= MINUS_HALF
    np.exp(density, out=density)
    density *= noise.peak
    return Comparison(squared, density)


def _bearing_residuals(
    east_m: Singles, north_m: Singles, headings_rad: Floats, seen: Sighting
) -> Singles:
    """(k, n): by how much bearings differ from those to (k, n) offsets, from (n,) headings."""
    residual_rad = arctan2(north_m, east_m)
    residual_rad -= _single(headings_rad)
    residual_rad -= _single(seen.bearing_rad)[:, None]

    turns = residual_rad / FULL_TURN_RAD
    np.rint(turns, out=turns)
    turns *= FULL_TURN_RAD
    residual_rad -= turns
    return residual_rad


def _range_residuals(
    east_m: Singles, north_m: Singles, range_gains: Floats, seen: Sighting
) -> Singles:
    """(k, n): by how much ranges differ from those to (k, n) offsets, which are overwritten."""
    east_m *= east_m
    north_m *= north_m
    east_m += north_m
    residual_m = np.sqrt(east_m, out=east_m)
    residual_m *= _single(1 + range_gains)
    residual_m -= _single(seen.range_m)[:, None]
    return residual_m


def _noise(seen: Sighting, offset_m: Floats) -> Noise:
    """The noise of views of landmarks at (k, 2) offsets from the agent."""
    covariance_m2 = seen.covariance_m2
    squared_m2 = np.square(offset_m).sum(axis=1)
    squared_m2 = np.maximum(squared_m2, 1e-6)

    along_m4 = np.einsum("ka,kab,kb->k", offset_m, covariance_m2, offset_m)
    radial_m2 = along_m4 / squared_m2
    total_m2 = covariance_m2[:, 0, 0] + covariance_m2[:, 1, 1]
    tangential_m2 = np.maximum(total_m2 - radial_m2, 0.0)

    has_bearing = seen.has_bearing
    sensed = np.square(seen.bearing_sd_rad)
    variance = sensed + tangential_m2 / squared_m2
    bearing_information = has_bearing / variance
    peak = np.where(has_bearing, sensed / variance, 1.0)

    has_range = seen.has_range
    sensed = np.square(seen.range_sd_m)
    variance = sensed + radial_m2
    range_information = has_range / variance
    peak *= np.where(has_range, sensed / variance, 1.0)

    return Noise(
        _single(bearing_information)[:, None],
        _single(range_information)[:, None],
        _single(np.sqrt(peak))[:, None],
    )


def _single(numbers: Floats) -> Singles:
    return numbers.astype(np.float32)


def log_likelihood(density: Singles, outlier: float, weights: Floats | None = None) -> Floats:
    """(n,): the logarithm of the product over landmarks of p(o_j | l_j, x), from (k, n) densities
    (eq. 1), each to the power of its weight (k,), or of 1.

    `outlier` is the share of percepts that may mean anything, so that a landmark taken for another
    outvotes nobody.
    """
    terms = density * (1 - outlier)
    terms += outlier
    np.log(terms, out=terms)

    total = terms.sum(axis=0) if weights is None else _single(weights) @ terms
    return np.asarray(total, np.float64)


def sightings(
    percepts: Iterable[Percept], graph: Graph, largest_sd_m: float, stationary_since_ns: int
) -> Sighting | None:
    """The percepts whose object on the map is known well enough to inform; None without any.

    Well enough is to `largest_sd_m`, and to half of its distance: samples on a ring around the
    agent have their mean where nothing is. It must also have been seen at least MIN_SIGHTINGS
    times, since a first sighting may have had another's name, and not from where the agent stands
    since `stationary_since_ns`: the same view again is no new evidence.
    """
    informing: list[Percept] = []
    landmarks: list[Object] = []
    for percept in percepts:
        landmark = graph.get(Object, object_id(percept.label))
        if landmark is not None and _informs(landmark, stationary_since_ns):
            informing.append(percept)
            landmarks.append(landmark)
    if not informing:
        return None

    seen = _sighting(informing, landmarks)
    is_sharp = _is_sharp(seen, largest_sd_m)
    if is_sharp.all():
        return seen
    return _select(seen, is_sharp) if is_sharp.any() else None


def _sighting(percepts: list[Percept], landmarks: list[Object]) -> Sighting:
    labels = []
    views = []
    for percept in percepts:
        labels.append(percept.label)
        view = (
            percept.bearing_rad,
            percept.range_m,
            percept.bearing_sd_rad,
            percept.range_sd_m,
        )
        views.append(view)

    mean_m = np.array([(landmark.x_m, landmark.y_m) for landmark in landmarks])
    covariance_m2 = _covariances(landmarks)
    return Sighting(tuple(labels), mean_m, covariance_m2, *np.array(views).T)


def _select(seen: Sighting, chosen: Booleans) -> Sighting:
    """The landmarks in view that are chosen (k,)."""
    labels = itertools.compress(seen.labels, chosen.tolist())
    return Sighting(
        labels=tuple(labels),
        mean_m=seen.mean_m[chosen],
        covariance_m2=seen.covariance_m2[chosen],
        bearing_rad=seen.bearing_rad[chosen],
        range_m=seen.range_m[chosen],
        bearing_sd_rad=seen.bearing_sd_rad[chosen],
        range_sd_m=seen.range_sd_m[chosen],
    )


def _covariances(landmarks: list[Object]) -> Floats:
    """(k, 2, 2): the covariances of landmarks' positions; 0 of one that has no samples."""
    covariances_m2 = np.zeros((len(landmarks), 2, 2))
    for index, landmark in enumerate(landmarks):
        if landmark.offsets_m is None:
            continue
        offsets_m = landmark.offsets_m.numpy().astype(np.float64)
        freedom = max(1, len(offsets_m) - 1)
        covariances_m2[index] = offsets_m.T @ offsets_m / freedom

    return covariances_m2


def _is_sharp(seen: Sighting, largest_sd_m: float) -> Booleans:
    """(k,): of which landmarks in view the position is known well enough."""
    share_m = MAX_SD_SHARE * seen.range_m
    limit_m = np.where(seen.has_range, share_m, np.inf)
    limit_m = np.minimum(largest_sd_m, limit_m)

    variances_m2 = np.einsum("kaa->k", seen.covariance_m2)
    is_sharp: Booleans = variances_m2 <= 2 * limit_m**2
    return is_sharp


def _informs(node: Object, stationary_since_ns: int) -> bool:
    """Whether another view of the landmark is evidence of where the agent is."""
    if is_seen_from_here(node, stationary_since_ns):
        return False

    return node.surveyed or node.sightings >= MIN_SIGHTINGS


def is_seen_from_here(node: Object, stationary_since_ns: int) -> bool:
    """Whether an agent that stands since `stationary_since_ns` has seen the landmark from where it
    stands.
    """
    is_stationary = stationary_since_ns != NEVER_NS
    return is_stationary and node.last_seen_ns >= stationary_since_ns
