"""The benchmark of places on recordings of real cameras."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.real import places
from cogmap.errors import UsageError

PICTURES = 12


def _walk(folder: Path, seed: int) -> Path:
    """Write pictures that have nothing to do with one another."""
    folder.mkdir()
    rng = np.random.default_rng(seed)
    for number in range(PICTURES):
        coarse = rng.integers(30, 220, (9, 12, 3), np.uint8)
        cv2.imwrite(str(folder / f"{number:03}.png"), cv2.resize(coarse, (160, 120)))

    return folder


def test_a_folder_without_pictures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="put JPEG or PNG files there"):
        places.measure(tmp_path, tmp_path)


def test_a_broken_picture_counts_as_one_that_is_not_recognized(tmp_path: Path) -> None:
    reference = _walk(tmp_path / "ref", 1)
    query = _walk(tmp_path / "query", 2)
    (query / "005.png").write_bytes(b"no picture")

    metrics = places.measure(reference, query)

    assert metrics["pictures"] == 2 * PICTURES
    assert metrics["sequence_recall"] == 0.0
    assert metrics["sequence_wrong"] == 0.0
