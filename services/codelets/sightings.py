"""What landmarks in view tell of where the agent is: the likelihood of eq. 1 (paper §5.4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from schemas.graph import Node
from schemas.mind import Task
from schemas.sensing import Percept
from services.codelets.sampling import Samples
from services.codelets.senses import RANGE

LARGEST_SHARE = 0.5
MOVING = -1


class Sighting(NamedTuple):
    """Landmarks in view, as arrays over those seen: where each is believed and where it is seen.

    A deviation of a half turn says that the bearing is not known, one as large as the range that the range is not.
    """

    labels: tuple[str, ...]
    mean_m: Samples
    covariance_m2: Samples
    bearing_rad: Samples
    range_m: Samples
    bearing_sd_rad: Samples
    range_sd_m: Samples

    @property
    def has_bearing(self) -> npt.NDArray[np.bool_]:
        """Of which the bearing is known."""
        return self.bearing_sd_rad < np.pi

    @property
    def has_range(self) -> npt.NDArray[np.bool_]:
        """Of which the range is known."""
        return self.range_sd_m < self.range_m


def has_bearing(percept: Percept) -> bool:
    """Whether its bearing is known."""
    return percept.bearing_sd_rad < np.pi


def has_range(percept: Percept) -> bool:
    """Whether its range is known."""
    return percept.range_sd_m < percept.range_m


def seen_from_here(landmark: Node, stands_ns: int) -> bool:
    """Whether an agent that stands since `stands_ns` has seen the landmark from where it stands: it sees the same."""
    return stands_ns != MOVING and int(landmark.attributes.get("stamp_ns", MOVING)) >= stands_ns


def sightings(task: Task, largest_sd_m: float, stands_ns: int) -> Sighting | None:
    """The percepts of `task` whose object is on the map well enough to tell something; None if there are none.

    Well enough is within `largest_sd_m`, and within half of its distance: samples on a ring around the agent have a
    mean where nothing is. Who stands still sees the same again, and that makes nobody surer.
    """
    known = {node.attributes.get("label"): node for node in task.nodes if node.kind == "object"}
    rows = []
    for percept in task.percepts:
        node = known.get(percept.label)
        if node is None or node.samples is None or seen_from_here(node, stands_ns):
            continue
        samples = np.asarray(node.samples.numpy(), np.float64)[:, :2]
        mean = samples.mean(axis=0)
        off = samples - mean
        covariance = off.T @ off / max(1, len(off) - 1)
        largest_m = min(largest_sd_m, LARGEST_SHARE * percept.range_m) if has_range(percept) else largest_sd_m
        if np.trace(covariance) <= 2 * largest_m**2:
            rows.append((mean, covariance, percept))
    if not rows:
        return None
    means, covariances, percepts = zip(*rows, strict=True)
    numbers = [(p.bearing_rad, p.range_m, p.bearing_sd_rad, p.range_sd_m) for p in percepts]
    labels = tuple(percept.label for percept in percepts)
    return Sighting(labels, np.array(means), np.array(covariances), *np.array(numbers).T)


class Comparison(NamedTuple):
    """How far n samples of the self are off each of k sightings, (k, n) each.

    `squared` is in squared deviations; `density` is relative to that of an exact match by a landmark whose place is
    certain.
    """

    squared: Samples
    density: Samples


def compare(samples: Samples, seen: Sighting) -> Comparison:
    """Each of (n, 7) samples of the self against what is seen."""
    east = seen.mean_m[:, :1] - samples[:, 0]
    north = seen.mean_m[:, 1:] - samples[:, 1]
    square = np.maximum(east * east + north * north, 1e-6)
    distance = np.sqrt(square)
    xx, xy, yy = (seen.covariance_m2[:, i, j, None] for i, j in ((0, 0), (0, 1), (1, 1)))
    radial_var = (east * east * xx + 2 * east * north * xy + north * north * yy) / square
    bearing_sd, range_sd = seen.bearing_sd_rad[:, None], seen.range_sd_m[:, None]
    bearing_var = bearing_sd**2 + np.maximum(xx + yy - radial_var, 0.0) / square
    range_var = range_sd**2 + radial_var
    turned = np.arctan2(north, east) - samples[:, 2] - seen.bearing_rad[:, None]
    turned -= 2 * np.pi * np.rint(turned / (2 * np.pi))
    away = distance * (1 + samples[:, RANGE]) - seen.range_m[:, None]
    with_bearing, with_range = seen.has_bearing[:, None], seen.has_range[:, None]
    squared = with_bearing * turned * turned / bearing_var + with_range * away * away / range_var
    sharp = np.where(with_bearing, bearing_sd**2 / bearing_var, 1.0) * np.where(
        with_range, range_sd**2 / range_var, 1.0
    )
    return Comparison(squared, np.exp(-squared / 2) * np.sqrt(sharp))


def log_likelihood(density: Samples, outlier: float) -> Samples:
    """log of the product over landmarks of p(o_j | l_j, x), (n,), of densities (k, n) (eq. 1).

    `outlier` is the share of sightings that may mean anything: a landmark taken for another outvotes nobody.
    """
    result: Samples = np.log((1 - outlier) * density + outlier).sum(axis=0)
    return result
