"""Grid maps and route problems in the MovingAI format."""

from __future__ import annotations

import lzma
from pathlib import Path

import pytest

from cogmap.data.moving_ai import read_map, read_problems
from cogmap.errors import UsageError

MAP = "type octile\nheight 2\nwidth 3\nmap\n.G@\nTS.\n"
LINE = "0\ta.map\t3\t2\t0\t0\t2\t1\t2.41421356"


def _file(folder: Path, text: str, name: str = "a.map") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def _problems(folder: Path, *lines: str, version: str = "version 1") -> Path:
    return _file(folder, "\n".join([version, *lines]) + "\n", "a.scen")


def test_a_map_is_read_by_column_and_row(tmp_path: Path) -> None:
    is_passable = read_map(_file(tmp_path, MAP))

    assert is_passable.tolist() == [[True, False], [True, True], [False, True]]


def test_a_packed_map_is_read_like_a_plain_one(tmp_path: Path) -> None:
    path = tmp_path / "a.map.xz"
    path.write_bytes(lzma.compress(MAP.replace("\n", "\r\n").encode()))

    assert read_map(path).tolist() == read_map(_file(tmp_path, MAP)).tolist()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("height 2\nwidth 3", "width 3\nheight\t2"),
        ("\n", "\r\n"),
        ("\n", " \n"),
        ("TS.\n", "TS."),
        ("TS.\n", "TS.\n\n\n"),
        ("type", "\ufefftype"),
    ],
)
def test_a_map_is_read_as_others_write_it(tmp_path: Path, old: str, new: str) -> None:
    plain = read_map(_file(tmp_path, MAP)).tolist()

    assert read_map(_file(tmp_path, MAP.replace(old, new))).tolist() == plain


def test_problems_are_read_with_their_optimal_length(tmp_path: Path) -> None:
    is_passable = read_map(_file(tmp_path, MAP))
    named = LINE.replace("a.map", "old town.map")
    path = _problems(tmp_path, LINE, "", named, version="version 1.0")

    problems = read_problems(path, is_passable)

    assert problems == [((0, 0), (2, 1), 2.41421356)] * 2


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("type octile", "type tile", "line 1: expected type octile"),
        ("width 3", "width three", "line 3: expected width"),
        ("height 2", "height -2", "line 2: expected height"),
        (".G@", ".G", "line 5: expected 3 cells"),
        ("TS.", "TX.", "line 6: expected 3 cells"),
        ("TS.\n", "", "ends before row 2 of 2"),
        ("height 2", "height 0", "0 cells"),
        ("height 2\n", "", "has no height or no width"),
        ("TS.\n", "TS.\n...\n", "line 7: expected the end after 2 rows"),
    ],
)
def test_what_is_wrong_in_a_map_is_named(tmp_path: Path, old: str, new: str, expected: str) -> None:
    path = _file(tmp_path, MAP.replace(old, new))

    with pytest.raises(UsageError, match=expected):
        read_map(path)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("version 1", "version 2", "line 1: expected version 1"),
        ("\t2.41421356", "", "line 2: expected bucket"),
        ("2.41421356", "nan", "line 2: expected an optimal length"),
        ("3\t2\t0", "512\t512\t0", "line 2: expected a problem for a map of 3 x 2 cells"),
        ("0\t0\t2", "0\t1\t2", r"line 2: expected \(0, 1\) to be a passable cell"),
        ("2\t1\t2.4", "9\t1\t2.4", r"line 2: expected \(9, 1\) to be a passable cell"),
        (LINE, "", "has no problem"),
    ],
)
def test_what_is_wrong_in_a_scenario_is_named(
    tmp_path: Path, old: str, new: str, expected: str
) -> None:
    is_passable = read_map(_file(tmp_path, MAP))
    path = _file(tmp_path, f"version 1\n{LINE}\n".replace(old, new), "a.scen")

    with pytest.raises(UsageError, match=expected):
        read_problems(path, is_passable)
