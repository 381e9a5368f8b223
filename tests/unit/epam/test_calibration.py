"""Calibration: an activation of 0.9 is right nine times in ten."""

from __future__ import annotations

import numpy as np
import pytest

from services.epam.recognition.objects import DIMENSIONS, Prototypes
from training.calibration import Calibrated, calibrate, calibration_error
from training.crops import Crops

TAUGHT = ["bakery", "bank", "cafe"]
STRANGERS = [f"invented-9-{number}" for number in range(6)]


def _made(noise: float, seed: int = 0, count: int = 1500) -> Calibrated:
    """Calibration by segments that look like what they show, but for so much `noise`; a fifth show
    no building.
    """
    rng = np.random.default_rng(seed)
    middles = rng.normal(size=(len(TAUGHT) + len(STRANGERS), DIMENSIONS))
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    which = rng.integers(len(middles), size=count)
    seen = middles[which] + noise * rng.normal(size=(count, DIMENSIONS))
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    nothing = rng.random(count) < 0.2
    names = np.where(nothing, "", np.array([*TAUGHT, *STRANGERS])[which])
    odds = np.where(nothing, -1.0, 1.0)[:, None] * 8.0 + rng.normal(size=(count, 2)) * 8.0
    crops = Crops(
        np.empty((count, 0)), names, ~nothing, np.arange(count), rng.integers(100, 9000, count)
    )
    plain = Prototypes(
        names=TAUGHT,
        directions=middles[: len(TAUGHT)].tolist(),
        size_m=[(9.0, 8.0, 6.0)] * len(TAUGHT),
        sharpness=1.0,
        unknown=0.0,
        novel_sharpness=1.0,
        novel_unknown=0.0,
        evidence=1.0,
    )
    return calibrate(seen.astype(np.float32), odds.astype(np.float32), crops, plain)


def test_what_looks_clear_is_told_apart_and_sure() -> None:
    clear = _made(noise=0.05).figures
    assert clear["top1"] > 0.8
    assert clear["met_once_top1"] > 0.95
    assert clear["never_met_told"] > 0.95


def test_the_activation_is_a_probability_also_where_looks_deceive() -> None:
    for noise in (0.05, 0.25, 0.4):
        assert _made(noise).figures["ece"] < 0.06


def test_boastful_evidence_is_taken_for_less() -> None:
    assert _made(noise=0.05).names.evidence < 0.6


def test_the_less_likeness_tells_the_less_sharp_it_is_taken() -> None:
    clear = _made(noise=0.1).names
    blurred = _made(noise=0.4).names
    assert clear.novel_sharpness > blurred.novel_sharpness
    assert clear.sharpness > blurred.sharpness


def test_calibration_error_is_the_gap_between_sureness_and_truth() -> None:
    right = np.arange(1000) % 2 == 0
    assert calibration_error(np.full(1000, 0.5), right) == pytest.approx(0.0)
    assert calibration_error(np.full(1000, 0.9), right) == pytest.approx(0.4)
    assert calibration_error(np.where(right, 0.99, 0.01), right) == pytest.approx(0.01)
