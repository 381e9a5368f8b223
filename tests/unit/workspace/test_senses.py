"""A cycle has the range scan of its view."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Task
from cogmap.schemas.sensing import RangeScan
from cogmap.services.workspace.senses import CLOCK_PERIOD_NS, MAX_SCAN_AGE_NS
from cogmap.testing import percepts, self_motion, stamp_ns
from tests.support.world.scenes import Desk

RAYS = ((0.1, 5.0), (0.0, 0.0))
SCANNED = Run(lockstep=True, participants={"sim": 1})
LATE_MS = MAX_SCAN_AGE_NS // 1_000_000


def _scan(frame: int, rays: Sequence[Sequence[float]] = RAYS, late_ms: float = 0) -> RangeScan:
    """The scan of view `frame`, or one that was taken before it."""
    bearing_rad, range_m = np.array(rays, np.float32).reshape(-1, 2).T
    return RangeScan(
        stamp_ns=stamp_ns(frame) - int(late_ms * 1e6),
        frame=frame,
        bearing_rad=Array.of(bearing_rad),
        range_m=Array.of(range_m),
    )


def _view(desk: Desk, frame: int) -> None:
    desk.see(frame)
    desk.work()


def _rays(desk: Desk, frame: int) -> list[list[float]] | None:
    """Bearing and range of each ray that the road task of view `frame` carries."""
    for message in desk.published:
        is_of_view = message.stamp_ns == stamp_ns(frame)
        if isinstance(message, Task) and message.codelet == "road_place" and is_of_view:
            return None if message.scan is None else message.scan.numpy().tolist()

    raise AssertionError(f"view {frame} had no task")


def _rounded(rays: Sequence[Sequence[float]]) -> list[list[float]]:
    return [[float(np.float32(value)) for value in ray] for ray in rays]


@pytest.fixture
def stepped() -> Desk:
    """In lockstep, with scans."""
    return Desk("w1", run=SCANNED)


@pytest.fixture
def timely() -> Desk:
    """In real time."""
    return Desk("w1", run=REAL_TIME)


def test_in_lockstep_a_cycle_waits_for_the_scan_of_its_view(stepped: Desk) -> None:
    stepped.feed(_scan(0))
    _view(stepped, 1)
    assert stepped.deltas == []

    stepped.feed(_scan(1))
    stepped.work()
    assert _rays(stepped, 1) == _rounded(RAYS)


def test_in_lockstep_a_scan_may_come_before_or_after_its_view(stepped: Desk) -> None:
    other = Desk("w1", run=SCANNED)
    for frame in range(3):
        stepped.feed(_scan(frame))
        _view(stepped, frame)
        _view(other, frame)
        other.feed(_scan(frame))
        other.work()

    assert stepped.digest == other.digest
    assert stepped.deltas[-1].cycle == 3


def test_a_scan_that_is_published_again_changes_nothing(stepped: Desk) -> None:
    stepped.feed(_scan(0))
    _view(stepped, 0)
    version = stepped.deltas[-1].version

    assert stepped.feed(_scan(0)) == []
    stepped.feed(self_motion(0))
    stepped.feed(percepts(0))
    assert stepped.deltas[-1].version == version


def test_an_interrupted_cycle_waits_for_its_scan_again(stepped: Desk) -> None:
    stepped.feed(_scan(0))
    _view(stepped, 0)
    restarted = Desk("w1", run=SCANNED)
    assert restarted.module.restore is not None
    restarted.module.restore(stepped.deltas[:2])

    _view(restarted, 0)
    assert restarted.deltas == []
    restarted.feed(_scan(0))
    restarted.work()
    assert restarted.digest == stepped.digest


def test_in_lockstep_without_scans_none_is_used_whenever_it_comes() -> None:
    desk = Desk("w1")
    desk.feed(_scan(0))
    _view(desk, 0)

    assert _rays(desk, 0) is None


def test_in_real_time_the_newest_scan_up_to_the_view_is_used(timely: Desk) -> None:
    older = _scan(0, ((0.0, 1.0),), late_ms=20)
    newer = _scan(0, ((0.0, 2.0),), late_ms=10)
    of_next_view = _scan(1, ((0.0, 3.0),))
    for scan in (older, newer, of_next_view):
        timely.feed(scan)
    _view(timely, 0)
    _view(timely, 1)

    assert _rays(timely, 0) == [[0.0, 2.0]]
    assert _rays(timely, 1) == [[0.0, 3.0]]


def test_in_real_time_a_scan_that_its_view_overtook_is_waited_for(timely: Desk) -> None:
    timely.feed(_scan(0))
    _view(timely, 0)
    timely.clock(stamp_ns(1))
    _view(timely, 1)
    assert timely.deltas[-1].cycle == 1

    timely.feed(_scan(1, ((0.0, 3.0),)))
    timely.work()
    assert _rays(timely, 1) == [[0.0, 3.0]]


def test_in_real_time_a_view_waits_for_its_scan_until_the_clock_has_passed(timely: Desk) -> None:
    timely.feed(_scan(0))
    _view(timely, 0)
    timely.clock(stamp_ns(1))
    _view(timely, 1)

    timely.clock(stamp_ns(1) + 1)
    timely.work()
    assert _rays(timely, 1) is None
    assert timely.deltas[-1].cycle == 2


def test_in_real_time_no_view_waits_for_a_clock_that_lags_behind_it(timely: Desk) -> None:
    timely.feed(_scan(0))
    _view(timely, 0)
    for frame in (1, 2, 3):
        timely.clock(stamp_ns(frame) - CLOCK_PERIOD_NS - 1)
        _view(timely, frame)

    assert timely.deltas[-1].cycle == 4


def test_in_real_time_a_scan_that_is_too_old_is_not_used(timely: Desk) -> None:
    timely.feed(_scan(0, late_ms=LATE_MS + 1))
    _view(timely, 0)

    assert _rays(timely, 0) is None
    assert timely.deltas[-1].cycle == 1


def test_in_real_time_a_scan_after_its_views_cycle_began_is_refused(timely: Desk) -> None:
    _view(timely, 0)

    with pytest.raises(MessageError, match="after its view's cycle had begun"):
        timely.feed(_scan(0))


def test_scans_that_are_not_two_equal_rows_of_numbers_are_refused(timely: Desk) -> None:
    one = Array.of(np.ones(1, np.float32))
    two = Array.of(np.ones(2, np.float32))
    doubles = Array.of(np.ones(2))
    behind = Array.of(np.array([1.0, -1.0], np.float32))

    for bearing_rad, range_m in ((one, two), (doubles, doubles), (two, behind)):
        scan = msgspec.structs.replace(_scan(0), bearing_rad=bearing_rad, range_m=range_m)
        with pytest.raises(MessageError, match="range scan"):
            timely.feed(scan)
