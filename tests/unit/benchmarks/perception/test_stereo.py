"""Disparities of a user's own pair of images, and options of the command that are refused."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks.commands import benchmarks
from benchmarks.perception import stereo
from cogmap.errors import UsageError

SIZE = (96, 160)
SHIFT_PX = 8
SCALE = 4


def test_a_pixel_errs_where_it_is_wrong_or_unmatched_and_the_truth_known() -> None:
    true_px = np.array([[10.0, 10.0, 10.0, 10.0, 0.0]], np.float32)
    found_px = np.array([[10.5, 12.0, 14.0, 0.0, 3.0]], np.float32)

    assert stereo.off_share(found_px, true_px, 1) == 0.75
    assert stereo.off_share(found_px, true_px, 3) == 0.5
    assert stereo.unmatched(found_px, true_px) == 0.25


def _pair(folder: Path) -> tuple[Path, Path, Path]:
    """A textured wall, 8 pixels of disparity, as files."""
    height, width = SIZE
    noise = np.random.default_rng(4).integers(0, 255, (height, width + SHIFT_PX, 3), np.uint8)
    wall = cv2.GaussianBlur(noise, (0, 0), 1.0)
    left = folder / "left.png"
    right = folder / "right.png"
    disparity = folder / "disparity.png"

    cv2.imwrite(str(left), wall[:, :width])
    cv2.imwrite(str(right), wall[:, SHIFT_PX:])
    cv2.imwrite(str(disparity), np.full(SIZE, SHIFT_PX * SCALE, np.uint8))
    return left, right, disparity


def test_a_pair_of_ones_own_is_matched_by_ours_and_by_plain(tmp_path: Path) -> None:
    metrics = stereo.measure(*_pair(tmp_path), float(SCALE))
    ratio = metrics["stereo_off_1px"] / metrics["plain_off_1px"]

    assert metrics["stereo_off_1px"] < 0.1
    assert metrics["stereo_off_1px_over_plain"] == pytest.approx(ratio)


def test_the_metrics_of_a_pair_are_written_as_json(tmp_path: Path) -> None:
    json_path = tmp_path / "metrics.json"
    pair = [str(path) for path in _pair(tmp_path)]
    options = ["--scale", str(SCALE), "--json", str(json_path)]
    result = CliRunner().invoke(benchmarks, ["perception", "--stereo", *pair, *options])

    assert result.exit_code == 0, result.output
    assert '"stereo_off_1px"' in json_path.read_text()


SMALL_IMAGE = cv2.imencode(".png", np.full((20, 30), 4, np.uint8))[1].tobytes()


@pytest.mark.parametrize("which", [0, 1, 2])
@pytest.mark.parametrize(
    ("content", "said"),
    [(None, "there is no file"), (b"text", "no image"), (SMALL_IMAGE, "of one size")],
    ids=["missing", "no image", "another size"],
)
def test_a_file_that_is_missing_or_no_image_or_of_another_size_is_named(
    which: int, content: bytes | None, said: str, tmp_path: Path
) -> None:
    wrong = tmp_path / "wrong.png"
    if content is not None:
        wrong.write_bytes(content)
    paths = [*_pair(tmp_path)]
    paths[which] = wrong

    with pytest.raises(UsageError, match=said) as refused:
        stereo.measure(*paths, float(SCALE))
    assert "wrong.png" in str(refused.value)


def test_disparities_without_sense_are_refused(tmp_path: Path) -> None:
    left, right, disparity = _pair(tmp_path)
    with pytest.raises(UsageError, match="--scale"):
        stereo.measure(left, right, disparity, 0.1)
    with pytest.raises(UsageError, match="one channel"):
        stereo.measure(left, right, left, 1.0)

    cv2.imwrite(str(disparity), np.zeros(SIZE, np.uint8))
    with pytest.raises(UsageError, match="no disparity over 0"):
        stereo.measure(left, right, disparity, 1.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scale", "4"], "belongs to --stereo"),
        (["--road-weights", "road.onnx"], "belongs to --camvid-test"),
        (["--by-drive"], "belongs to --camvid"),
        (["--camvid", "a", "--camvid-test", "b", "c"], "not both"),
        (["--stereo", "a", "b", "c", "--scale", "0"], "--scale"),
        (["--stereo", "a", "b"], "--stereo"),
        (["--json", "nowhere/figures.json"], "there is no folder"),
    ],
)
def test_options_that_do_not_go_together_are_refused_in_a_sentence(
    arguments: list[str], said: str
) -> None:
    result = CliRunner().invoke(benchmarks, ["perception", *arguments])

    assert result.exit_code == 2
    assert said in result.output
