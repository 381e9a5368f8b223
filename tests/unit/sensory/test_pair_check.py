"""Pairs whose images do not belong together, or are badly exposed."""

from __future__ import annotations

import logging
from collections.abc import Callable

import cv2
import numpy as np
import pytest

from cogmap.schemas.sensing import SelfMotion, View
from cogmap.services.sensory.module import Config, build
from cogmap.services.sensory.self_motion.sense import Source
from cogmap.testing import of_type
from tests.support.world.stereo_street import Image, frame, pair

STEP_NS = 100_000_000
STEP_M = 0.6
FAULTY = range(6, 9)
LAST = 11
Change = Callable[[int, Image, Image], tuple[Image, Image]]


def _at(number: int) -> tuple[Image, Image]:
    return pair((STEP_M * number, 0.0, 0.0))


def _late(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    return left, pair((STEP_M * (number - 1) + 0.05, 0.0, 0.0))[1]


def _repeated(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    return left, _at(FAULTY[0] - 1)[1]


def _swapped(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    return right, left


def _turned(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    turn = cv2.getRotationMatrix2D((160, 60), 1.5, 1.0)
    return left, cv2.warpAffine(right, turn, (320, 120), borderMode=cv2.BORDER_REPLICATE)


def _covered(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    return left, np.full_like(right, 3)


def _unchanged(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    return left, right


def _drive(change: Change) -> tuple[list[View], list[SelfMotion], list[str]]:
    """The views and motions of a drive, of which `change` applies to the frames FAULTY, and what
    the module notes of it.
    """
    module = build(Config(self_motion=Source.VIEWS), "sensory")
    published = []
    for number in range(LAST + 1):
        images = _at(number)
        if number in FAULTY:
            images = change(number, *images)
        published += module.feed(frame(number, (number + 1) * STEP_NS, images))

    assert module.notes is not None
    return of_type(View, published), of_type(SelfMotion, published), module.notes()


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (_late, "not taken at the same time"),
        (_repeated, "that of the frame before"),
        (_swapped, "are swapped"),
        (_turned, "off their rows"),
        (_covered, "does not show what the left one does"),
    ],
)
def test_a_pair_that_does_not_belong_together_is_counted_named_and_has_no_depth(
    change: Change, expected: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    views, motions, notes = _drive(change)
    known = [bool((view.depth_m.numpy() > 0).any()) for view in views]
    said = [record.message for record in caplog.records]

    (note,) = notes
    assert note.startswith(f"{len(FAULTY)} stereo pairs: ")
    assert expected in note
    assert len(said) == 2
    assert expected in said[0]
    assert "belong together again" in said[1]
    assert known == [number not in FAULTY for number in range(LAST + 1)]
    assert len(motions) == LAST + 1


@pytest.mark.parametrize("change", [_late, _repeated, _swapped, _turned, _covered])
def test_motion_over_such_pairs_is_doubted_and_never_far_off(change: Change) -> None:
    _, motions, _ = _drive(change)
    for number, motion in enumerate(motions[1:], start=1):
        speed_m_s, _, dt_s, speed_sd_m_s, _ = motion.motions.numpy().T
        sd_m = float(np.sqrt(((speed_sd_m_s * dt_s) ** 2).sum()))
        error_m = abs(float(speed_m_s @ dt_s) - STEP_M)

        assert error_m < 4 * sd_m
        if number in FAULTY:
            assert sd_m > 0.04


def test_pairs_that_belong_together_are_not_complained_of(
    caplog: pytest.LogCaptureFixture,
) -> None:
    _, _, notes = _drive(_unchanged)
    assert notes == []
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


@pytest.mark.parametrize("offset_px", [-2, 2])
def test_a_right_camera_that_looks_aside_is_noticed_and_corrected(offset_px: int) -> None:
    module = build(Config(self_motion=Source.VIEWS), "sensory")
    published = []
    for number in range(30):
        left, right = _at(number)
        images = (left, np.roll(right, offset_px, axis=1))
        published += module.feed(frame(number, (number + 1) * STEP_NS, images))
    *_, motion = of_type(SelfMotion, published)
    speed_m_s, _, dt_s, *_ = motion.motions.numpy().T

    assert module.notes is not None
    (note,) = module.notes()
    added_px = float(note.split("unless ")[1].split()[0])
    assert added_px == pytest.approx(offset_px, abs=0.4)
    assert float(speed_m_s @ dt_s) == pytest.approx(STEP_M, rel=0.04)


def test_what_the_sun_has_blotted_out_has_no_depth() -> None:
    left, right = _at(0)
    for image in (left, right):
        image[20:60, 100:220] = 255
    module = build(Config(self_motion=Source.VIEWS), "sensory")
    (view,) = of_type(View, module.feed(frame(0, STEP_NS, (left, right))))
    depth_m = view.depth_m.numpy()

    assert not depth_m[24:56, 104:216].any()
    assert (depth_m[70:, 60:] > 0).mean() > 0.8


def _smeared(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    return cv2.blur(left, (13, 1)), cv2.blur(right, (13, 1))


def _brighter(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    return tuple(np.clip(image * 1.3, 0, 255).astype(np.uint8) for image in (left, right))


def _banded(number: int, left: Image, right: Image) -> tuple[Image, Image]:
    rows = 1 + 0.25 * np.sin(np.arange(len(left)) / 12 + number)[:, None]
    return tuple(np.clip(image * rows, 0, 255).astype(np.uint8) for image in (left, right))


@pytest.mark.parametrize("change", [_smeared, _brighter, _banded])
def test_blur_and_exposure_are_met_with_doubt(change: Change) -> None:
    _, motions, _ = _drive(change)
    for motion in motions[1:]:
        speed_m_s, _, dt_s, speed_sd_m_s, _ = motion.motions.numpy().T
        sd_m = float(np.sqrt(((speed_sd_m_s * dt_s) ** 2).sum()))
        assert abs(float(speed_m_s @ dt_s) - STEP_M) < 4 * sd_m
