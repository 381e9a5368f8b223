"""`cogmap memory`: what is in a database, and its way to another."""

from __future__ import annotations

import base64
import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from cogmap.cli.main import cogmap, main
from cogmap.errors import StorageError, UsageError
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record, digest_of
from tests.support.reference import REFERENCE

OLD = Record("scene-1", "scene", b"\x00\xff" * 500)
EVENT = Record("event-1", "event", b"")
NEW = Record("scene-2", "scene", b"new")


def memory_command(*arguments: str | Path) -> Result:
    """`cogmap memory` with these arguments. Raises what it raises."""
    words = ["memory", *map(str, arguments)]
    result = CliRunner().invoke(cogmap, words, standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result


def kept(path: Path) -> list[Record]:
    database = Database(path)
    records = list(database.records())
    database.close()
    return records


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A database whose sequence numbers have gaps."""
    path = tmp_path / "memory.db"
    database = Database(path)
    database.put([OLD, NEW, EVENT])
    database.put([NEW])
    database.close()
    return path


@pytest.fixture
def exported(path: Path) -> Path:
    target = path.with_name("memory.jsonl")
    memory_command("export", path, target)
    return target


def test_what_is_shown_counts_records_and_bytes_by_kind(path: Path) -> None:
    found = json.loads(memory_command("show", path, "--json").stdout)

    assert found["file_bytes"] == path.stat().st_size
    assert found["all"] == {"records": 3, "payload_bytes": 1003, "newest": "scene-2"}
    assert found["kinds"] == {
        "scene": {"records": 2, "payload_bytes": 1003, "newest": "scene-2"},
        "event": {"records": 1, "payload_bytes": 0, "newest": "event-1"},
    }


def test_what_is_shown_is_a_table_for_people(path: Path) -> None:
    shown = memory_command("show", path).stdout

    assert "memory.db: 3 records" in shown
    assert "event-1" in shown


def test_an_export_has_a_head_and_a_line_a_record(exported: Path) -> None:
    head, first, *others = [json.loads(line) for line in exported.read_text().splitlines()]

    assert head == {"format": "cogmap-memory", "version": 1, "count": 3}
    assert first == {
        "key": OLD.key,
        "kind": OLD.kind,
        "payload": base64.b64encode(OLD.payload).decode(),
        "digest": base64.b64encode(digest_of(OLD, sequence=1)).decode(),
    }
    assert [line["key"] for line in others] == [EVENT.key, NEW.key]


def test_an_import_has_the_same_records_in_the_same_order(exported: Path, path: Path) -> None:
    copy = path.with_name("copy.db")
    memory_command("import", exported, copy)

    assert kept(copy) == kept(path) == [OLD, EVENT, NEW]


def test_neither_export_nor_import_overwrites_a_file(exported: Path, path: Path) -> None:
    before = (path.read_bytes(), exported.read_bytes())

    with pytest.raises(StorageError, match=r"memory\.jsonl exists already: move it away"):
        memory_command("export", path, exported)
    with pytest.raises(StorageError, match=r"memory\.db exists already: move it away"):
        memory_command("import", exported, path)

    assert (path.read_bytes(), exported.read_bytes()) == before


@pytest.mark.parametrize(
    ("number", "damaged"),
    [
        (2, b'{"key": "scene-1"}\n'),
        (3, b'{"key": "\\ud800", "kind": "event", "payload": "", "digest": ""}\n'),
        (3, b"\xff\xfe\n"),
        (4, b""),
    ],
)
def test_a_damaged_line_is_named_and_nothing_is_made(
    exported: Path, tmp_path: Path, number: int, damaged: bytes
) -> None:
    lines = exported.read_bytes().splitlines(keepends=True)
    lines[number - 1] = damaged or lines[number - 1][:-3]
    exported.write_bytes(b"".join(lines))

    with pytest.raises(StorageError, match=rf"memory\.jsonl, line {number} is damaged"):
        memory_command("import", exported, tmp_path / "copy.db")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["memory.db", "memory.jsonl"]


def test_lines_in_another_order_are_damaged(exported: Path, tmp_path: Path) -> None:
    head, first, second, third = exported.read_bytes().splitlines(keepends=True)
    exported.write_bytes(head + first + third + second)

    with pytest.raises(StorageError, match="line 3 is damaged"):
        memory_command("import", exported, tmp_path / "copy.db")


def test_an_export_that_lacks_its_last_line_is_refused(exported: Path, tmp_path: Path) -> None:
    lines = exported.read_bytes().splitlines(keepends=True)
    exported.write_bytes(b"".join(lines[:-1]))

    with pytest.raises(StorageError, match=r"memory\.jsonl has 2 records of 3: name another"):
        memory_command("import", exported, tmp_path / "copy.db")


@pytest.mark.parametrize(
    ("head", "sentence"),
    [
        (b"", "line 1 is not the head of an export"),
        (b'{"format": "mcap", "version": 1, "count": 0}\n', "line 1 is not the head"),
        (b'{"format": "cogmap-memory", "version": 2, "count": 0}\n', "of version 2, and this pro"),
    ],
)
def test_a_file_that_is_no_export_is_refused(tmp_path: Path, head: bytes, sentence: str) -> None:
    source = tmp_path / "other.jsonl"
    source.write_bytes(head)

    with pytest.raises(StorageError, match=sentence):
        memory_command("import", source, tmp_path / "copy.db")


def test_a_check_ends_with_0_where_nothing_is_damaged(path: Path) -> None:
    result = memory_command("check", path)

    assert result.exit_code == 0
    assert result.stdout == f"{path}: 3 records, none damaged\n"


def test_a_check_ends_with_2_and_a_sentence_where_something_is(
    path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:-4096])
    monkeypatch.setattr(sys, "argv", ["cogmap", "memory", "check", str(path)])

    with pytest.raises(SystemExit) as ended:
        main()

    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith(f"cogmap: {path} is damaged (")


def test_a_log_is_no_memory_and_stays_where_it_is() -> None:
    with pytest.raises(UsageError, match=r"reference.mcap is a log, .*`cogmap log info"):
        memory_command("show", REFERENCE)
