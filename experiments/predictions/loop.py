"""Where an animal ran, when it rested, and the loop by which it first came back to a place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.polylines import distances_along

# Below this speed animals are taken to rest, as is usual where replay is looked for.
IMMOBILE_M_S = 0.05
SMOOTHING_S = 0.25
MIN_REST_S = 1.0
# Positions are not interpolated over a longer time without any.
MAX_GAP_S = 1.0
# What is near is a share of the diagonal of the ground that the animal ran on.
NEAR_SHARE = 0.05
# Samples of the loop within what is near, so that positions along it are finer than that.
FINE = 10


class Movement(NamedTuple):
    """Samples of running, in the order of time: `stamps_s` (n,), how long each lasts `dt_s` (n,),
    `positions_m` (n, 2) and unit vectors `ahead` (n, 2). `rests_s` (k, 2) is when the animal
    rested. `near_m` is the distance within which two positions are taken for the same place, and
    `extent_m` the diagonal of the ground.
    """

    stamps_s: Floats
    dt_s: Floats
    positions_m: Floats
    ahead: Floats
    rests_s: Floats
    near_m: float
    extent_m: float


class Loop(NamedTuple):
    """The first loop: places `points_m` (m, 2), each with its direction `ahead` (m, 2) and its
    distance `along_m` (m,) from where the loop begins, closed at `closed_s`.
    """

    points_m: Floats
    ahead: Floats
    along_m: Floats
    length_m: float
    closed_s: float


def movement_of(stamps_s: Floats, positions_m: Floats) -> Movement:
    """Tell running from rest by the speed of the smoothed positions (n, 2)."""
    steps_s = np.diff(stamps_s)
    usual_s = float(np.median(steps_s))
    smooth_m = gaussian_filter1d(positions_m, SMOOTHING_S / usual_s, axis=0)
    velocity = np.gradient(smooth_m, stamps_s, axis=0)
    speed = np.hypot(*velocity.T)
    is_running = speed > IMMOBILE_M_S

    extent_m = 0.0
    if is_running.any():
        extent_m = float(np.hypot(*np.ptp(smooth_m[is_running], axis=0)))
    dt_s = np.minimum(np.append(steps_s, usual_s), MAX_GAP_S)
    return Movement(
        stamps_s=stamps_s[is_running],
        dt_s=dt_s[is_running],
        positions_m=smooth_m[is_running],
        ahead=velocity[is_running] / speed[is_running, None],
        rests_s=_rests(stamps_s, ~is_running),
        near_m=NEAR_SHARE * extent_m,
        extent_m=extent_m,
    )


def _rests(stamps_s: Floats, is_resting: Booleans) -> Floats:
    """Return beginnings and ends (k, 2) of rest that lasts, none of them across a gap."""
    joins = is_resting[1:] & is_resting[:-1] & (np.diff(stamps_s) < MAX_GAP_S)
    padded = np.concatenate([[False], joins, [False]])
    change = np.diff(padded.astype(int))
    begins = stamps_s[np.flatnonzero(change == 1)]
    ends = stamps_s[np.flatnonzero(change == -1)]
    spans_s = np.column_stack([begins, ends])
    return np.asarray(spans_s[ends - begins >= MIN_REST_S])


def first_loop(movement: Movement) -> Loop | None:
    """Find the first loop: the animal comes near to where it has been, in about the same direction,
    after it ran farther than the diagonal of its ground. None if it never does.
    """
    if not movement.extent_m:
        return None

    run_m = distances_along(movement.positions_m)
    every_m = np.arange(0.0, run_m[-1], movement.near_m / 2)
    rows = np.unique(np.searchsorted(run_m, every_m))
    tree = cKDTree(_features(movement.positions_m[rows], movement.ahead[rows], movement.near_m))
    for row, feature in zip(rows.tolist(), tree.data, strict=True):
        near = rows[tree.query_ball_point(feature, movement.near_m)]
        before = near[run_m[row] - run_m[near] >= movement.extent_m]
        if len(before):
            return _loop(movement, int(before.min()), row)
    return None


def _loop(movement: Movement, begin: int, end: int) -> Loop:
    """Take the loop from one sample to another. It is closed when the animal is near to where it
    began, which it may be before it turns in the direction in which it left.
    """
    is_near = np.hypot(*(movement.positions_m - movement.positions_m[begin]).T) <= movement.near_m
    run_m = distances_along(movement.positions_m)
    ends = is_near & (run_m <= run_m[end]) & (run_m >= run_m[end] - 2 * movement.near_m)
    closed = int(np.flatnonzero(ends).min(initial=end))

    rows = slice(begin, end + 1)
    points_m = movement.positions_m[rows]
    along_m = distances_along(points_m)
    gap_m = float(np.hypot(*(points_m[-1] - points_m[0])))
    wanted_m = np.arange(0.0, along_m[-1], movement.near_m / FINE)
    fine = np.searchsorted(along_m, wanted_m)
    return Loop(
        points_m=points_m[fine],
        ahead=movement.ahead[rows][fine],
        along_m=along_m[fine],
        length_m=float(along_m[-1]) + gap_m,
        closed_s=float(movement.stamps_s[closed]),
    )


def along(loop: Loop, movement: Movement) -> Floats:
    """Return how far along the loop each sample of running is, (n,) metres; NaN for one that is not
    on it, or runs it in the other direction.
    """
    tree = cKDTree(_features(loop.points_m, loop.ahead, movement.near_m))
    known = _features(movement.positions_m, movement.ahead, movement.near_m)
    apart, nearest = tree.query(known)
    found_m = loop.along_m[nearest]
    return np.where(apart <= 2 * movement.near_m, found_m, np.nan)


def wrapped(offset_m: Floats, length_m: float) -> Floats:
    """Return offsets along a closed loop of this length as the shorter ones, -length/2 to
    length/2.
    """
    return np.asarray((offset_m + length_m / 2) % length_m - length_m / 2)


def _features(positions_m: Floats, ahead: Floats, near_m: float) -> Floats:
    """Return (n, 4) features: those of one place, 60° apart in direction, are `near_m` apart."""
    return np.hstack([positions_m, near_m * ahead])
