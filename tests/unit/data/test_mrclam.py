"""MRCLAM folders, right and wrong."""

from __future__ import annotations

import lzma
from pathlib import Path

import pytest

from cogmap.data.mrclam import read
from cogmap.errors import UsageError

FILES = {
    "Barcodes": "# Subject # Barcode #\n1 5\n6 63\n7 25\n",
    "Landmark_Groundtruth": "# Subject x y sd sd\n6 1.0 -2.0 0.0 0.0\n7 0.5 4.0 0.0 0.0\n",
    "Robot1_Odometry": "# Time v w\n10.0 0.1 0.0\n10.5 0.2 -0.1\n",
    "Robot1_Measurement": (
        "# Time barcode r b\n10.2 63 2.0 0.1\n10.3 5 1.0 0.0\n10.1 25 3.0 -0.2\n10.4 99 3.0 0.0\n"
    ),
    "Robot1_Groundtruth": "# Time x y o\n10.0 0.0 0.0 0.0\n10.5 0.1 0.0 0.0\n",
}


def _folder(path: Path, **changed: str | None) -> Path:
    for name, text in {**FILES, **changed}.items():
        if text is not None:
            (path / f"{name}.dat").write_text(text)
    return path


def test_a_set_is_read_with_barcodes_as_subjects_and_by_time(
    tmp_path: Path,
) -> None:
    recording = read(_folder(tmp_path))
    (robot,) = recording.robots

    subjects = robot.observations[:, 1].tolist()
    landmarks = robot.landmark_observations[:, 1].tolist()

    assert recording.landmarks == {6: (1.0, -2.0), 7: (0.5, 4.0)}
    assert subjects == [7, 6, 1]
    assert landmarks == [7, 6]
    assert robot.unread == 1


def test_files_packed_with_xz_are_read_as_they_are(tmp_path: Path) -> None:
    (plain,) = read(_folder(tmp_path)).robots
    for path in list(tmp_path.glob("*.dat")):
        packed = lzma.compress(path.read_bytes())
        path.with_suffix(".dat.xz").write_bytes(packed)
        path.unlink()

    (robot,) = read(tmp_path).robots
    assert (robot.odometry == plain.odometry).all()


def test_numbers_between_wide_spaces_of_latin_1_are_read(tmp_path: Path) -> None:
    (plain,) = read(_folder(tmp_path)).robots
    path = tmp_path / "Robot1_Odometry.dat"
    path.write_bytes(path.read_bytes().replace(b" ", b"\xa0"))

    (robot,) = read(tmp_path).robots

    assert (robot.odometry == plain.odometry).all()


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        (
            "Robot1_Odometry",
            "10.0 0.1 0.0\n10.5 fast -0.1\n",
            "Robot1_Odometry.dat, line 2: expected a time, a speed",
        ),
        (
            "Robot1_Measurement",
            "# t b r b\n10.2 63 -2.0 0.1\n",
            "line 2: expected a time, a barcode, a range above 0",
        ),
        ("Landmark_Groundtruth", "6 1.0 nan 0.0 0.0\n", "line 1: expected a subject, x, y"),
        ("Barcodes", "1 5 9\n", "line 1: expected a subject and its barcode"),
        ("Robot1_Groundtruth", "# nothing\n", "has no line with a time, x, y and a heading"),
    ],
)
def test_a_wrong_line_is_named_with_its_number_and_what_was_expected(
    tmp_path: Path, name: str, text: str, expected: str
) -> None:
    folder = _folder(tmp_path, **{name: text})

    with pytest.raises(UsageError, match=expected.replace(".", r"\.")):
        read(folder)


def test_a_file_that_is_missing_is_named(tmp_path: Path) -> None:
    folder = _folder(tmp_path, Robot1_Measurement=None)

    with pytest.raises(UsageError, match=r"has no Robot1_Measurement\.dat"):
        read(folder)


def test_a_folder_without_robots_or_that_is_none_is_refused(tmp_path: Path) -> None:
    without_robots = _folder(tmp_path, Robot1_Odometry=None)

    with pytest.raises(UsageError, match="there is no folder"):
        read(tmp_path / "nowhere")
    with pytest.raises(UsageError, match="has no Robot1_Odometry"):
        read(without_robots)
