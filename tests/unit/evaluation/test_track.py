"""A path by the time that its poses are of."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.evaluation.track import Track


def test_a_track_keeps_its_order_when_an_old_pose_comes_late() -> None:
    track = Track()
    for stamp_ns in (1, 3, 2):
        track.add(stamp_ns, float(stamp_ns), 0.0, 0.0)

    covered = track.covers(np.arange(5))

    assert track.stamps_ns.tolist() == [1, 3]
    assert covered.tolist() == [False, True, True, True, False]


def test_between_two_poses_a_heading_turns_the_shorter_way() -> None:
    track = Track()
    track.add(0, 0.0, 0.0, math.pi - 0.2)
    track.add(10, 2.0, 4.0, -math.pi + 0.2)

    (middle,) = track.at(np.array([5]))

    assert middle == pytest.approx([1.0, 2.0, math.pi])


def test_of_a_long_track_every_second_pose_stays_and_its_ends() -> None:
    track = Track(most=8)
    for stamp_ns in range(30):
        track.add(stamp_ns, float(stamp_ns), 0.0, 0.0)

    assert len(track) <= 8
    assert (track.stamps_ns[0], track.last_ns) == (0, 29)
    assert track.at(np.arange(30))[:, 0] == pytest.approx(np.arange(30))
