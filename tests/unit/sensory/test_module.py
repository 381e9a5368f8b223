"""Sensory memory: what it says does not depend on how frames and odometry interleave."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec
import numpy as np
import pytest

from cogmap.bus import codec
from cogmap.errors import MessageError
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Calibration, Odometry, RangeScan, SelfMotion, StereoFrame, View
from cogmap.services.sensory.module import Config, build
from cogmap.services.sensory.self_motion.sense import Source
from cogmap.testing import of_type
from tests.support.world.stereo_street import CAMERA, frame, pair

STEP_NS = 50_000_000
CALIBRATION = Calibration(
    width_px=96,
    height_px=64,
    fx_px=60,
    fy_px=60,
    cx_px=47.5,
    cy_px=31.5,
    baseline_m=0.5,
    mount_height_m=1.2,
)


def _odometry(step: int, speed_m_s: float = 2.0) -> Odometry:
    return Odometry(
        stamp_ns=step * STEP_NS, speed_m_s=speed_m_s, turn_rate_rad_s=0.1 * step, dt_s=0.05
    )


def _frame(number: int, step: int, calibration: Calibration = CALIBRATION) -> StereoFrame:
    image = np.random.default_rng(number).integers(0, 255, (64, 100, 3), np.uint8)
    return StereoFrame(
        stamp_ns=step * STEP_NS,
        frame=number,
        left=Array.of(image[:, :96]),
        right=Array.of(image[:, 4:]),
        calibration=calibration,
    )


def _published(messages: Iterable[Message]) -> list[Message]:
    module = build(Config(), "sensory")
    published = []
    for message in messages:
        published += module.feed(message)
    return published


def _rows(first: int, last: int) -> list[Odometry]:
    """The odometry from one step to another, both included."""
    return [_odometry(step) for step in range(first, last + 1)]


def test_a_frame_waits_for_the_odometry_up_to_its_stamp() -> None:
    module = build(Config(), "sensory")
    assert module.feed(_frame(0, 2)) == []
    assert module.feed(_odometry(1)) == []

    messages = module.feed(_odometry(2))
    types = [type(message) for message in messages]
    stamps_ns = {message.stamp_ns for message in messages}
    assert types == [View, RangeScan, SelfMotion]
    assert stamps_ns == {2 * STEP_NS}


def test_any_interleaving_of_frames_with_their_odometry_gives_the_same_bytes() -> None:
    rows = _rows(1, 8)
    first = _frame(0, 4)
    second = _frame(1, 8)
    in_order = [*rows[:4], first, *rows[4:], second]
    frames_first = [first, *rows[:4], second, *rows[4:]]
    mixed = [rows[0], first, *rows[1:5], second, *rows[5:]]
    late = [first, *rows[:7], second, rows[7]]

    expected = _plain(_published(in_order))

    assert len(expected) == 6
    for order in (frames_first, mixed, late):
        assert _plain(_published(order)) == expected


def test_motions_cover_exactly_what_came_since_the_last_view() -> None:
    messages = _published([*_rows(1, 9), _frame(0, 3), _frame(1, 8)])
    first, second = of_type(SelfMotion, messages)
    assert first.since_ns == 0
    assert first.motions.shape == (3, 5)
    assert second.since_ns == 3 * STEP_NS
    assert second.stamp_ns == 8 * STEP_NS

    # Odometry's own steps; what is seen moves them all alike.
    turn_rates = second.motions.numpy()[:, 1]
    assert np.diff(turn_rates) == pytest.approx([0.1] * 4, abs=1e-9)


def test_a_newer_frame_replaces_a_waiting_one_and_no_motion_is_lost() -> None:
    messages = _published(
        [
            _odometry(1),
            _frame(0, 1),
            _frame(1, 3),
            _frame(2, 5),
            *(_odometry(s) for s in range(2, 6)),
        ]
    )
    motions = [message for message in messages if isinstance(message, SelfMotion)]

    assert [message.frame for message in motions] == [0, 2]
    assert (motions[1].since_ns, motions[1].motions.shape) == (STEP_NS, (4, 5))


def test_the_first_frame_without_earlier_odometry_has_no_motion() -> None:
    *_, motion = _published([_frame(0, 4), _odometry(5)])

    assert isinstance(motion, SelfMotion)
    assert motion.since_ns == 4 * STEP_NS
    assert motion.motions.shape == (0, 5)


def test_older_frames_and_odometry_are_ignored() -> None:
    messages = [*_rows(1, 2), _frame(0, 2)]
    older = [_frame(7, 1), _odometry(2), _odometry(1)]

    assert len(_published([*messages, *older])) == 3


def _plain(messages: Iterable[Message]) -> list[bytes]:
    """The messages as bytes, without their number."""
    return [codec.encode(msgspec.structs.replace(message, seq=0)) for message in messages]


def test_the_last_frame_published_again_gets_the_same_answer_again() -> None:
    module = build(Config(), "sensory")
    before = [*_rows(1, 4), _frame(0, 4), *_rows(5, 8)]
    for message in before:
        module.feed(message)
    answer = module.feed(_frame(1, 8))

    for row in _rows(5, 8):
        assert module.feed(row) == []
    assert _plain(module.feed(_frame(1, 8))) == _plain(answer)


def test_a_frame_published_again_is_integrated_only_once() -> None:
    first = [*_rows(1, 4), _frame(0, 4), *_rows(5, 8), _frame(1, 8)]
    rest = [*_rows(9, 12), _frame(2, 12)]
    once = _published([*first, *rest])
    twice = _published([*first, _frame(1, 8), *rest])

    assert _plain(twice[-3:]) == _plain(once[-3:])


def test_a_rectified_frame_keeps_its_image_and_calibration() -> None:
    frame = _frame(0, 1)
    (view,) = of_type(View, _published([_odometry(1), frame]))

    assert view.image == frame.left
    assert view.calibration == CALIBRATION
    assert view.depth_m.dtype == "<f4"
    assert view.depth_m.shape == (64, 96)


def _resized(frame: StereoFrame, name: str, values: np.ndarray) -> StereoFrame:
    return msgspec.structs.replace(frame, **{name: Array.of(values)})


def test_grey_images_give_the_same_as_colour_images_of_no_colour() -> None:
    frame = _frame(0, 1)
    left = frame.left.numpy()[..., 0]
    right = frame.right.numpy()[..., 0]
    grey = _resized(_resized(frame, "left", left), "right", right)
    colour = _resized(
        _resized(frame, "left", np.dstack([left] * 3)), "right", np.dstack([right] * 3)
    )

    assert _plain(_published([_odometry(1), grey])) == _plain(_published([_odometry(1), colour]))


def test_large_images_are_worked_at_the_size_that_is_set() -> None:
    config = Config(max_pixels=10_000, self_motion=Source.VIEWS)
    large = msgspec.structs.replace(
        CAMERA, width_px=400, height_px=150, fx_px=250.0, fy_px=250.0, cx_px=199.5, cy_px=74.5
    )
    module = build(config, "sensory")
    (view,) = of_type(View, module.feed(frame(0, STEP_NS, pair((0.0, 0.0, 0.0), large), large)))
    camera = view.calibration
    depth_m = view.depth_m.numpy()
    row = 55
    ground_m = camera.mount_height_m * camera.fy_px / (row - camera.cy_px)

    assert camera.width_px * camera.height_px <= 10_000
    assert view.image.shape == (camera.height_px, camera.width_px, 3)
    assert camera.fx_px / camera.width_px == pytest.approx(250 / 400)
    assert (camera.cx_px + 0.5) / camera.width_px == pytest.approx(0.5)
    assert np.median(depth_m[row, 60:100]) == pytest.approx(ground_m, rel=0.05)


@pytest.mark.parametrize(
    "wrong",
    [
        _resized(_frame(0, 1), "left", np.zeros((64, 96, 2), np.uint8)),
        _resized(_frame(0, 1), "right", np.zeros((64, 95, 3), np.uint8)),
        _resized(_frame(0, 1), "left", np.zeros((64, 96, 3), np.float32)),
        _resized(_frame(0, 1), "right", np.zeros((0, 0, 3), np.uint8)),
        _frame(0, 10**9),
    ],
)
def test_a_frame_that_makes_no_sense_is_refused_and_changes_nothing(wrong: StereoFrame) -> None:
    module = build(Config(), "sensory")
    module.feed(_odometry(1))

    with pytest.raises(MessageError):
        module.feed(wrong)
    assert len(module.feed(_frame(0, 1))) == 3


@pytest.mark.parametrize("row", [_odometry(2, speed_m_s=1e12), _odometry(10**9)])
def test_odometry_that_makes_no_sense_is_refused_and_changes_nothing(row: Odometry) -> None:
    module = build(Config(), "sensory")
    module.feed(_odometry(1))

    with pytest.raises(MessageError):
        module.feed(row)

    module.feed(_odometry(2))
    *_, motion = module.feed(_frame(0, 2))

    assert isinstance(motion, SelfMotion)
    assert motion.motions.shape == (2, 5)


def test_it_receives_and_publishes_what_the_table_of_topics_names() -> None:
    module = build(Config(), "sensory")
    received = set(module.handlers)

    assert received == {topics.STEREO, topics.ODOMETRY}
    assert module.emits == {topics.SELF_MOTION, topics.SCAN, topics.VIEW}
