"""What landmarks in view tell of where the agent is: the likelihood of eq. 1 (paper §5.4)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans
from schemas.graph import Node
from schemas.sensing import Percept
from services.codelets.localization.motion_model import RANGE
from services.codelets.localization.sampling import Samples

Singles = npt.NDArray[np.float32]
LARGEST_SHARE = 0.5
ENOUGH = 2
MOVING = -1
TURN = np.float32(2 * np.pi)
# Squared deviations beyond which densities would be denormal numbers, by which everything is slow.
IMPOSSIBLE = np.float32(150.0)


class Sighting(NamedTuple):
    """Landmarks in view, as arrays over those seen: where each is believed and where it is seen.

    A deviation of a half turn says that the bearing is not known, one as large as the range that
    the range is not.
    """

    labels: tuple[str, ...]
    mean_m: Samples
    covariance_m2: Samples
    bearing_rad: Samples
    range_m: Samples
    bearing_sd_rad: Samples
    range_sd_m: Samples

    @property
    def has_bearing(self) -> Booleans:
        """Of which the bearing is known."""
        return self.bearing_sd_rad < np.pi

    @property
    def has_range(self) -> Booleans:
        """Of which the range is known."""
        return self.range_sd_m < self.range_m


def has_bearing(percept: Percept) -> bool:
    """Whether its bearing is known."""
    return percept.bearing_sd_rad < np.pi


def has_range(percept: Percept) -> bool:
    """Whether its range is known."""
    return percept.range_sd_m < percept.range_m


def seen_from_here(landmark: Node, stands_ns: int) -> bool:
    """Whether an agent that stands since `stands_ns` has seen the landmark from where it stands: it
    sees the same.
    """
    return stands_ns != MOVING and int(landmark.attributes.get("stamp_ns", MOVING)) >= stands_ns


def sightings(
    percepts: Iterable[Percept], nodes: Iterable[Node], largest_sd_m: float, stands_ns: int
) -> Sighting | None:
    """The percepts whose object among `nodes` is known well enough to tell something; None if there
    are none.

    Well enough is within `largest_sd_m`, and within half of its distance, since samples on a ring
    around the agent have a mean where nothing is; and seen there more than once, since a first
    sighting may have had another's name. Who stands still sees the same again, and that makes
    nobody surer.
    """
    known = {node.attributes.get("label"): node for node in nodes if node.kind == "object"}
    rows = []
    for percept in percepts:
        node = known.get(percept.label)
        if node is None or node.samples is None or _says_nothing(node, stands_ns):
            continue
        samples = np.asarray(node.samples.numpy(), np.float64)[:, :2]
        mean = np.full(len(samples), 1 / len(samples)) @ samples
        off = samples - mean
        covariance = off.T @ off / max(1, len(off) - 1)
        largest_m = (
            min(largest_sd_m, LARGEST_SHARE * percept.range_m)
            if has_range(percept)
            else largest_sd_m
        )
        if covariance[0, 0] + covariance[1, 1] <= 2 * largest_m**2:
            rows.append((mean, covariance, percept))
    if not rows:
        return None
    means, covariances, known_ones = zip(*rows, strict=True)
    numbers = [(p.bearing_rad, p.range_m, p.bearing_sd_rad, p.range_sd_m) for p in known_ones]
    labels = tuple(percept.label for percept in known_ones)
    return Sighting(labels, np.array(means), np.array(covariances), *np.array(numbers).T)


def _says_nothing(landmark: Node, stands_ns: int) -> bool:
    return int(landmark.attributes.get("sightings", ENOUGH)) < ENOUGH or seen_from_here(
        landmark, stands_ns
    )


class Comparison(NamedTuple):
    """How far n samples of the self are off each of k sightings, (k, n) each, of single precision.

    `squared` is in squared deviations; `density` is relative to that of an exact match by a
    landmark whose place is certain.
    """

    squared: Singles
    density: Singles


def compare(samples: Samples, seen: Sighting) -> Comparison:
    """Each of (n, 7) samples of the self against what is seen.

    How unsure a landmark's own place makes its range and its bearing is worked out for the middle
    of the samples.
    """
    middle = np.full(len(samples), 1 / len(samples)) @ samples[:, :2]
    bearing_var, range_var = _variances(seen, seen.mean_m - middle)
    sharp = np.where(seen.has_bearing, seen.bearing_sd_rad**2 / bearing_var, 1.0)
    sharp *= np.where(seen.has_range, seen.range_sd_m**2 / range_var, 1.0)
    per_turned = _single(seen.has_bearing / bearing_var)
    per_away = _single(seen.has_range / range_var)
    east, north = (_single(seen.mean_m[:, axis, None] - samples[:, axis]) for axis in (0, 1))
    turned = np.arctan2(north, east)
    turned -= _single(samples[:, 2])
    turned -= _single(seen.bearing_rad)[:, None]
    turned -= TURN * np.rint(turned / TURN)
    turned *= turned
    turned *= per_turned[:, None]
    east *= east
    north *= north
    away = np.sqrt(np.add(east, north, out=east), out=east)
    away *= _single(1 + samples[:, RANGE])
    away -= _single(seen.range_m)[:, None]
    away *= away
    away *= per_away[:, None]
    squared = np.add(turned, away, out=away)
    density = np.exp(np.minimum(squared, IMPOSSIBLE, out=turned) / -2)
    density *= _single(np.sqrt(sharp))[:, None]
    return Comparison(squared, density)


def _variances(seen: Sighting, off_m: Samples) -> tuple[Samples, Samples]:
    """(k,) of bearing and of range, of landmarks that are (k, 2) off."""
    square = np.maximum((off_m**2).sum(axis=1), 1e-6)
    radial = np.einsum("ka,kab,kb->k", off_m, seen.covariance_m2, off_m) / square
    across = np.maximum(np.trace(seen.covariance_m2, axis1=1, axis2=2) - radial, 0.0)
    return seen.bearing_sd_rad**2 + across / square, seen.range_sd_m**2 + radial


def _single(numbers: Samples) -> Singles:
    return numbers.astype(np.float32)


def log_likelihood(density: Singles, outlier: float) -> Samples:
    """log of the product over landmarks of p(o_j | l_j, x), (n,), of densities (k, n) (eq. 1).

    `outlier` is the share of sightings that may mean anything: a landmark taken for another
    outvotes nobody.
    """
    result = np.log((1 - outlier) * density + outlier).sum(axis=0)
    return np.asarray(result, np.float64)
