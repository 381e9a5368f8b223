"""Where the objects known here stand on a map that was learned before: the relative position of the
two. Pure.

A hypothesis is a pose of this map's frame in the other one, from two objects here and two there
that look alike and are as far apart. It is as good as the number of objects that it places where
one of the same look stands.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.estimation.alignment import motion_onto
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import rotate, transform_from, wrap_angle

# Pairs nearer than this hardly tell the turn, and farther ones are left out. The maximum bounds the
# time: hypotheses by the farthest pairs come first.
NEAREST_PAIR_M = 6.0
FARTHEST_PAIR_M = 80.0
MAX_HYPOTHESES = 4000
# Fits of the best pose to all that it matches, which may then match more.
REFINEMENTS = 3
# Poses whose places for the middle of what is here, and turns, differ by less (15°) are the same.
SAME_POSE_M = 5.0
SAME_POSE_RAD = 0.26
NOWHERE = -1


class Landmarks(NamedTuple):
    """Objects by what they look like, (n,) numbers, and where they are, (n, 2)."""

    looks: Indices
    at_m: Floats


class Match(NamedTuple):
    """The `pose` (3,) of this map's frame in the other, and to which landmark there each landmark
    here belongs, (n,), NOWHERE where to none.
    """

    pose: Floats
    there: Indices

    @property
    def matched(self) -> int:
        """Return how many landmarks here stand where one there does."""
        return int((self.there != NOWHERE).sum())


def best_matches(here: Landmarks, there: Landmarks, within_m: float) -> tuple[Match, int] | None:
    """Find the match of most landmarks, and how many the best match at any other pose has; None if
    no two landmarks of each are alike.
    """
    poses = _hypotheses(here, there, within_m)
    if not len(poses):
        return None

    counts = _counts(poses, here, there, within_m)
    pose = poses[counts.argmax()]
    match = Match(pose, _belonging(pose, here, there, within_m))
    for _ in range(REFINEMENTS):
        is_matched = match.there != NOWHERE
        if is_matched.sum() < 2:
            break

        # It is moved to where all that belong together fit best.
        fitted = motion_onto(here.at_m[is_matched], there.at_m[match.there[is_matched]])
        match = Match(fitted, _belonging(fitted, here, there, within_m))

    # Another pose places the middle of what is here elsewhere, or turns it.
    middle_m = here.at_m.mean(axis=0)
    moved_m = rotate(np.broadcast_to(middle_m, (len(poses), 2)), poses[:, 2]) + poses[:, :2]
    away_m = np.hypot(*(moved_m - transform_from(match.pose, middle_m[None])).T)
    turned_rad = np.abs(wrap_angle(poses[:, 2] - match.pose[2]))
    is_other = (away_m > SAME_POSE_M) | (turned_rad > SAME_POSE_RAD)
    return match, int(counts[is_other].max(initial=0))


def _hypotheses(here: Landmarks, there: Landmarks, within_m: float) -> Floats:
    """Find (h, 3) poses that bring two landmarks here to where two alike stand there."""
    looks = 1 + max(here.looks.max(initial=0), there.looks.max(initial=0))
    pairs_here, apart_here_m = _pairs(here)
    pairs_there, apart_there_m = _pairs(there)

    one, other = np.nonzero(
        _codes(here, pairs_here, looks)[:, None] == _codes(there, pairs_there, looks)
    )
    is_as_far = np.abs(apart_here_m[one] - apart_there_m[other]) <= within_m
    one, other = one[is_as_far], other[is_as_far]
    if len(one) > MAX_HYPOTHESES:
        farthest = np.argsort(-apart_here_m[one], kind="stable")[:MAX_HYPOTHESES]
        one, other = one[farthest], other[farthest]

    # The middles of pairs are moved onto each other, and turned to one direction.
    here_m = here.at_m[pairs_here[one]]
    there_m = there.at_m[pairs_there[other]]
    turn_rad = _direction(there_m) - _direction(here_m)
    shift_m = there_m.mean(axis=1) - rotate(here_m.mean(axis=1), turn_rad)
    return np.column_stack([shift_m, wrap_angle(turn_rad)])


def _codes(landmarks: Landmarks, pairs: Indices, looks: int) -> Indices:
    """Return a number for the looks of each of (p, 2) pairs, (p,)."""
    first, second = landmarks.looks[pairs].T
    codes: Indices = first * looks + second
    return codes


def _pairs(landmarks: Landmarks) -> tuple[Indices, Floats]:
    """Find the (p, 2) pairs of landmarks neither too near each other nor too far apart, in both
    orders, and the distance between the two, (p,).
    """
    offsets_m = landmarks.at_m[:, None] - landmarks.at_m
    apart_m = np.hypot(offsets_m[..., 0], offsets_m[..., 1])
    is_pair = (apart_m >= NEAREST_PAIR_M) & (apart_m <= FARTHEST_PAIR_M)
    return np.argwhere(is_pair), apart_m[is_pair]


def _direction(pairs_m: Floats) -> Floats:
    """Compute the direction from the first to the second of (h, 2, 2) pairs, (h,)."""
    along_m = pairs_m[:, 1] - pairs_m[:, 0]
    return np.arctan2(along_m[:, 1], along_m[:, 0])


def _counts(poses: Floats, here: Landmarks, there: Landmarks, within_m: float) -> Indices:
    """Count the landmarks here that each pose places where one alike stands, (h,)."""
    counts = np.zeros(len(poses), np.int64)
    for look, at_m in zip(here.looks.tolist(), here.at_m, strict=True):
        alike_m = there.at_m[there.looks == look]
        if not len(alike_m):
            continue

        moved_m = rotate(np.broadcast_to(at_m, (len(poses), 2)), poses[:, 2]) + poses[:, :2]
        offsets_m = moved_m[:, None] - alike_m
        nearest_m = np.hypot(offsets_m[..., 0], offsets_m[..., 1]).min(axis=1)
        counts += nearest_m <= within_m

    return counts


def _belonging(pose: Floats, here: Landmarks, there: Landmarks, within_m: float) -> Indices:
    """Find the landmark there that each landmark here belongs to by a pose, (n,), no two to one."""
    moved_m = transform_from(pose, here.at_m)
    offsets_m = moved_m[:, None] - there.at_m
    away_m = np.hypot(offsets_m[..., 0], offsets_m[..., 1])
    away_m[here.looks[:, None] != there.looks] = np.inf

    belongs = np.full(len(here.looks), NOWHERE)
    for number in np.argsort(away_m.min(axis=1, initial=np.inf), kind="stable").tolist():
        nearest = int(away_m[number].argmin())
        if away_m[number, nearest] <= within_m:
            belongs[number] = nearest
            away_m[:, nearest] = np.inf

    return belongs
