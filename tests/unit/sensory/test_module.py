"""Sensory memory: what it says does not depend on how frames and odometry interleave."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from cogmap.bus import codec
from cogmap.errors import MessageError
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.sensing import Calibration, Odometry, RangeScan, SelfMotion, StereoFrame, View
from services.sensory.module import Config, build

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
    return [answer for message in messages for answer in module.feed(message)]


def test_a_frame_waits_for_the_odometry_up_to_its_stamp() -> None:
    module = build(Config(), "sensory")

    assert module.feed(_frame(0, 2)) == []
    assert module.feed(_odometry(1)) == []

    messages = module.feed(_odometry(2))

    assert [type(message) for message in messages] == [SelfMotion, RangeScan, View]
    assert {message.stamp_ns for message in messages} == {2 * STEP_NS}


def test_any_interleaving_of_frames_with_their_odometry_gives_the_same_bytes() -> None:
    rows = [_odometry(step) for step in range(1, 9)]
    first = _frame(0, 4)
    second = _frame(1, 8)
    orders = (
        [*rows[:4], first, *rows[4:], second],
        [first, *rows[:4], second, *rows[4:]],
        [rows[0], first, *rows[1:5], second, *rows[5:]],
        [first, *rows[:7], second, rows[7]],
    )
    outputs = [[codec.encode(message) for message in _published(order)] for order in orders]

    assert len(outputs[0]) == 6
    assert all(output == outputs[0] for output in outputs)


def test_motions_cover_exactly_what_came_since_the_last_view() -> None:
    messages = _published([*(_odometry(step) for step in range(1, 10)), _frame(0, 3), _frame(1, 8)])
    first, second = [message for message in messages if isinstance(message, SelfMotion)]

    assert (first.since_ns, first.motions.shape) == (0, (3, 5))
    assert (second.since_ns, second.stamp_ns) == (3 * STEP_NS, 8 * STEP_NS)

    turn_rates = [float(row[1]) for row in second.motions.numpy()]
    steps = [round(after - before, 9) for before, after in pairwise(turn_rates)]

    assert steps == [0.1] * 4  # odometry's own steps; what is seen moves them all alike


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
    motion = _published([_frame(0, 4), _odometry(5)])[0]

    assert isinstance(motion, SelfMotion)
    assert (motion.since_ns, motion.motions.shape) == (4 * STEP_NS, (0, 5))


def test_older_frames_and_odometry_are_ignored() -> None:
    messages = [_odometry(1), _odometry(2), _frame(0, 2)]

    assert len(_published([*messages, _frame(7, 1), _odometry(2), _odometry(1)])) == 3


def _plain(messages: Iterable[Message]) -> list[bytes]:
    """The messages as bytes, without their number."""
    return [codec.encode(msgspec.structs.replace(message, seq=0)) for message in messages]


def test_the_last_frame_published_again_gets_the_same_answer_again() -> None:
    rows = [_odometry(step) for step in range(1, 9)]
    module = build(Config(), "sensory")
    for message in (*rows[:4], _frame(0, 4), *rows[4:]):
        module.feed(message)

    answer = module.feed(_frame(1, 8))

    for row in rows[4:]:
        assert module.feed(row) == []
    assert _plain(module.feed(_frame(1, 8))) == _plain(answer)


def test_a_frame_published_again_is_integrated_only_once() -> None:
    rows = [_odometry(step) for step in range(1, 13)]
    frames = [_frame(0, 4), _frame(1, 8), _frame(2, 12)]
    once = [*rows[:4], frames[0], *rows[4:8], frames[1], *rows[8:], frames[2]]
    twice = [*rows[:4], frames[0], *rows[4:8], frames[1], frames[1], *rows[8:], frames[2]]

    assert _plain(_published(twice)[-3:]) == _plain(_published(once)[-3:])


def test_a_rectified_frame_keeps_its_image_and_calibration() -> None:
    frame = _frame(0, 1)
    view = _published([_odometry(1), frame])[2]

    assert isinstance(view, View)
    assert view.image == frame.left
    assert view.calibration == CALIBRATION
    assert (view.depth_m.dtype, view.depth_m.shape) == ("<f4", (64, 96))


def _resized(frame: StereoFrame, name: str, values: np.ndarray) -> StereoFrame:
    return msgspec.structs.replace(frame, **{name: Array.of(values)})


@pytest.mark.parametrize(
    "frame",
    [
        _resized(_frame(0, 1), "left", np.zeros((64, 96), np.uint8)),
        _resized(_frame(0, 1), "right", np.zeros((64, 95, 3), np.uint8)),
        _resized(_frame(0, 1), "left", np.zeros((64, 96, 3), np.float32)),
        _resized(_frame(0, 1), "right", np.zeros((0, 0, 3), np.uint8)),
        _frame(0, 10**9),
    ],
)
def test_a_frame_that_makes_no_sense_is_refused_and_changes_nothing(frame: StereoFrame) -> None:
    module = build(Config(), "sensory")
    module.feed(_odometry(1))

    with pytest.raises(MessageError):
        module.feed(frame)
    assert len(module.feed(_frame(0, 1))) == 3


@pytest.mark.parametrize("row", [_odometry(2, speed_m_s=1e12), _odometry(10**9)])
def test_odometry_that_makes_no_sense_is_refused_and_changes_nothing(row: Odometry) -> None:
    module = build(Config(), "sensory")
    module.feed(_odometry(1))

    with pytest.raises(MessageError):
        module.feed(row)

    module.feed(_odometry(2))
    motion = module.feed(_frame(0, 2))[0]

    assert isinstance(motion, SelfMotion)
    assert motion.motions.shape == (2, 5)


def test_it_receives_and_publishes_what_the_table_of_topics_names() -> None:
    module = build(Config(), "sensory")

    assert set(module.handlers) == {topics.STEREO, topics.ODOMETRY}
    assert module.emits == {topics.SELF_MOTION, topics.SCAN, topics.VIEW}
