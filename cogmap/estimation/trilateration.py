"""Where points are by their distances from known places: robust nonlinear least squares, from the
best of the places where two circles meet.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats, Indices

# A range that deviates by this many standard deviations counts half as much as one that fits.
DOUBTED = 2.0
# Ranges of a point, evenly chosen, whose circles are intersected pair by pair, and those that
# judge the intersections.
CIRCLES = 12
JUDGES = 200
MAX_ITERATIONS = 50
SETTLED_M = 1e-4
# Added to information in m^-2, so that a point that is heard from one direction alone has some.
LEAST_INFORMATION = 1e-6


def positions_from_ranges(
    centres_m: Floats, ranges_m: Floats, sds_m: Floats, point: Indices, gain_sd: float
) -> tuple[Floats, Floats, float]:
    """Return the positions (k, 2) of k points, their covariances (k, 2, 2), and the share by which
    ranges are too large.

    Each of (m,) ranges with standard deviations `sds_m` is from one of (m, 2) `centres_m` to
    `point` (m,), 0 to k - 1; each point has some. The gain is common to all, about 0 with `gain_sd`
    (Gauss-Newton on points and gain together, weighed by Cauchy's function).
    """
    count = int(point.max(initial=-1)) + 1
    positions_m = np.zeros((count, 2))
    for number in range(count):
        of_it = point == number
        positions_m[number] = _first_position(centres_m[of_it], ranges_m[of_it], sds_m[of_it])

    gain = 0.0
    information = np.tile(np.eye(2), (count, 1, 1))
    for _ in range(MAX_ITERATIONS):
        offset_m = positions_m[point] - centres_m
        distance_m = np.hypot(offset_m[:, 0], offset_m[:, 1]).clip(1e-6)
        residual_m = ranges_m - (1 + gain) * distance_m
        weight = 1 / (1 + np.square(residual_m / sds_m) / DOUBTED**2) / sds_m**2

        # The points' blocks, and the column that the gain has in common with all.
        towards = (1 + gain) * offset_m / distance_m[:, None]
        blocks = towards[:, :, None] * towards[:, None, :] * weight[:, None, None]
        information = _sums(blocks, point, count) + LEAST_INFORMATION * np.eye(2)
        shared = _sums(towards * (weight * distance_m)[:, None], point, count)
        pull = _sums(towards * (weight * residual_m)[:, None], point, count)

        moved_by_gain = np.linalg.solve(information, shared[..., None])[..., 0]
        moved = np.linalg.solve(information, pull[..., None])[..., 0]
        gain_step = 0.0
        if gain_sd:
            left = float((weight * distance_m**2).sum() - (shared * moved_by_gain).sum())
            wanted = float((weight * distance_m * residual_m).sum() - (shared * moved).sum())
            gain_step = (wanted - gain / gain_sd**2) / (left + gain_sd**-2)

        step_m = moved - moved_by_gain * gain_step
        positions_m = positions_m + step_m
        gain += gain_step
        if np.abs(step_m).max(initial=0.0) < SETTLED_M:
            break

    covariance_m2 = np.asarray(np.linalg.inv(information), np.float64)
    return positions_m, covariance_m2, gain


def _first_position(centres_m: Floats, ranges_m: Floats, sds_m: Floats) -> Floats:
    """Return where most ranges (m,) agree, among the places (2,) where the circles of some meet."""
    some = np.unique(np.linspace(0, len(ranges_m) - 1, CIRCLES).astype(np.int64))
    first, second = (some[index] for index in np.triu_indices(len(some), 1))
    candidates_m = _intersections(centres_m, ranges_m, first, second)
    if not len(candidates_m):
        return np.asarray(centres_m[0] + (ranges_m[0], 0.0), np.float64)

    judges = np.unique(np.linspace(0, len(ranges_m) - 1, JUDGES).astype(np.int64))
    offset_m = candidates_m[:, None] - centres_m[judges]
    distance_m = np.hypot(offset_m[..., 0], offset_m[..., 1])
    deviation = (distance_m - ranges_m[judges]) / sds_m[judges]
    cost = np.log1p(np.square(deviation) / DOUBTED**2).sum(axis=1)
    return np.asarray(candidates_m[cost.argmin()], np.float64)


def _intersections(centres_m: Floats, ranges_m: Floats, first: Indices, second: Indices) -> Floats:
    """Return both places (2 n, 2) where the circles of n pairs meet, or come nearest."""
    base_m = centres_m[second] - centres_m[first]
    base_length_m = np.hypot(base_m[:, 0], base_m[:, 1])
    is_apart = base_length_m > 1e-6
    first, second = first[is_apart], second[is_apart]
    base_length_m = base_length_m[is_apart]
    along = base_m[is_apart] / base_length_m[:, None]

    squares_m2 = ranges_m[first] ** 2 - ranges_m[second] ** 2 + base_length_m**2
    along_m = squares_m2 / (2 * base_length_m)
    along_m = along_m.clip(-ranges_m[first], ranges_m[first])
    across_m = np.sqrt((ranges_m[first] ** 2 - along_m**2).clip(0.0))
    across = np.column_stack([-along[:, 1], along[:, 0]])

    foot_m = centres_m[first] + along_m[:, None] * along
    aside_m = across_m[:, None] * across
    return np.vstack([foot_m + aside_m, foot_m - aside_m])


def _sums(values: Floats, point: Indices, count: int) -> Floats:
    """Compute the (k, ...) sums of the (m, ...) values of each point's ranges."""
    _, *shape = values.shape
    sums = np.zeros((count, *shape))
    np.add.at(sums, point, values)
    return sums
