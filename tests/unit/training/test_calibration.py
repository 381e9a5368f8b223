"""Calibration: an activation of 0.9 is right nine times in ten."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from cogmap.services.epam.recognition.objects import DIMENSIONS, Prototypes
from cogmap.training.calibration import Calibrated, calibrate, calibration_error
from cogmap.training.crops import Crops

TAUGHT = ["bakery", "bank", "cafe"]
NOVEL = [f"invented-9-{number}" for number in range(6)]


def _calibrated(
    noise: float, seed: int = 0, count: int = 1500, novel: Sequence[str] = NOVEL
) -> Calibrated:
    """Calibration on segments whose embeddings have this much `noise`; a fifth show no building."""
    rng = np.random.default_rng(seed)
    directions = _unit(rng.normal(size=(len(TAUGHT) + len(novel), DIMENSIONS)))
    which = rng.integers(len(directions), size=count)
    embeddings = _unit(directions[which] + noise * rng.normal(size=(count, DIMENSIONS)))

    background = rng.random(count) < 0.2
    log_odds = np.where(background, -1.0, 1.0)[:, None] * 8.0 + rng.normal(size=(count, 2)) * 8.0
    crops = Crops(
        values=np.empty((count, 0), np.float16),
        name=np.where(background, "", np.array([*TAUGHT, *novel])[which]),
        whole=~background,
        view=np.arange(count),
        area_px=rng.integers(100, 9000, count),
    )
    prototypes = Prototypes(
        names=TAUGHT,
        directions=directions[: len(TAUGHT)].tolist(),
        size_m=[(9.0, 8.0, 6.0)] * len(TAUGHT),
        sharpness=1.0,
        unknown=0.0,
        novel_sharpness=1.0,
        novel_unknown=0.0,
        evidence=1.0,
        taught_share=0.5,
    )
    return calibrate(embeddings.astype(np.float32), log_odds.astype(np.float32), crops, prototypes)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_clear_embeddings_are_recognized_taught_novel_and_unknown() -> None:
    metrics = _calibrated(noise=0.05).metrics

    assert metrics["top1"] > 0.8
    assert metrics["novel_top1"] > 0.95
    assert metrics["novel_unknown_recall"] > 0.95


@pytest.mark.parametrize("noise", [0.05, 0.25, 0.4])
def test_the_activation_is_a_probability_with_any_noise(noise: float) -> None:
    calibrated = _calibrated(noise)

    assert calibrated.metrics["ece"] < 0.06


def test_overconfident_log_odds_are_scaled_down() -> None:
    calibrated = _calibrated(noise=0.05)

    assert calibrated.prototypes.evidence < 0.6


def test_noisier_embeddings_get_a_lower_sharpness() -> None:
    clear = _calibrated(noise=0.1).prototypes
    noisy = _calibrated(noise=0.4).prototypes

    assert clear.novel_sharpness > noisy.novel_sharpness
    assert clear.sharpness > noisy.sharpness


def test_calibration_error_is_the_gap_between_activation_and_accuracy() -> None:
    correct = np.arange(1000) % 2 == 0
    guessing = np.full(1000, 0.5)
    too_sure = np.full(1000, 0.9)
    knowing = np.where(correct, 0.99, 0.01)

    assert calibration_error(guessing, correct) == pytest.approx(0.0)
    assert calibration_error(too_sure, correct) == pytest.approx(0.4)
    assert calibration_error(knowing, correct) == pytest.approx(0.01)


def test_the_share_of_taught_buildings_is_that_of_those_calibrated_on() -> None:
    found = _calibrated(noise=0.05).prototypes.taught_share

    assert found == pytest.approx(len(TAUGHT) / (len(TAUGHT) + len(NOVEL)), abs=0.05)


def test_where_no_stranger_was_seen_there_still_may_be_one() -> None:
    assert 0.99 < _calibrated(noise=0.05, novel=[]).prototypes.taught_share < 1.0
