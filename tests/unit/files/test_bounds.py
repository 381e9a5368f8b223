"""Files that hold more than they may are refused by a sentence, before they fill the memory."""

from __future__ import annotations

import bz2
import gzip
import lzma
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from mcap.writer import Writer

from cogmap.data import osm
from cogmap.data.text import numbered_lines, read_bytes
from cogmap.errors import BoundError, ConfigError, LogError
from cogmap.files.bounds import FLOOR_BYTES, VARIABLE
from cogmap.files.packed import read_arrays
from cogmap.files.toml import parsed
from cogmap.recording.storage.chunks import CHUNK_BYTES
from cogmap.recording.storage.format import SOFTWARE
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.recover import recover

PACKERS = [gzip.compress, bz2.compress, lzma.compress]
Packer = Callable[[bytes], bytes]


@pytest.mark.parametrize("pack", PACKERS)
def test_a_small_file_that_unpacks_to_a_large_one_is_refused(tmp_path: Path, pack: Packer) -> None:
    path = tmp_path / "bomb"
    path.write_bytes(pack(bytes(FLOOR_BYTES + 1)))

    with pytest.raises(BoundError, match=rf"bomb unpacks to more than 16 MiB.*{VARIABLE}"):
        read_bytes(path, "a file")


def test_what_unpacks_to_a_few_times_its_size_is_read_however_large(tmp_path: Path) -> None:
    content = np.random.default_rng(1).integers(0, 16, FLOOR_BYTES + 1, np.uint8).tobytes()
    path = tmp_path / "large.gz"
    path.write_bytes(gzip.compress(content, 1))

    assert read_bytes(path, "a file") == content


def test_a_line_without_an_end_is_bounded_too(tmp_path: Path) -> None:
    path = tmp_path / "line.bz2"
    path.write_bytes(bz2.compress(b"x" * (FLOOR_BYTES + 1)))

    with pytest.raises(BoundError):
        next(numbered_lines(path, "a file"))


def test_the_variable_alone_bounds_files_where_it_is_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "packed"
    path.write_bytes(gzip.compress(bytes(FLOOR_BYTES + 1)))
    monkeypatch.setenv(VARIABLE, "17")
    assert len(read_bytes(path, "a file")) == FLOOR_BYTES + 1

    path.write_bytes(bytes((17 << 20) + 1))
    with pytest.raises(BoundError, match="packed holds more than 17 MiB"):
        read_bytes(path, "a file")


@pytest.mark.parametrize("value", ["0", "x", "-1", "9" * 5000])
def test_the_variable_must_be_a_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: str
) -> None:
    monkeypatch.setenv(VARIABLE, value)

    with pytest.raises(ConfigError, match=VARIABLE):
        read_bytes(Path(__file__), "a file")


def test_an_extract_that_unpacks_to_gigabytes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.osm.xz"
    node = b'<node id="1" lat="48.4" lon="15.6"/>'
    path.write_bytes(lzma.compress(b"<osm>" + node * (FLOOR_BYTES // len(node) + 1)))

    with pytest.raises(BoundError, match=r"bomb\.osm\.xz unpacks"):
        osm.read(path)


def test_arrays_that_unpack_to_gigabytes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    np.savez_compressed(path, a=np.zeros(FLOOR_BYTES, np.uint8), b=np.zeros(9, np.uint8))

    with pytest.raises(BoundError, match=r"bomb\.npz unpacks"):
        read_arrays(path)


def bomb(folder: Path, size: int, claimed: int, compression: str) -> Path:
    """A log of one chunk, of that many zeros, that says to have `claimed`."""
    import lz4.frame

    pack = lz4.frame.compress if compression == "lz4" else zstandard.compress
    path = folder / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("", SOFTWARE)
        record = RecordBuilder()
        Chunk(compression, pack(bytes(size)), 2, 1, 0, claimed).write(record)
        file.write(record.end())
        writer.finish()
    return path


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
@pytest.mark.parametrize("claimed", [CHUNK_BYTES + 1, 64])
def test_a_chunk_that_unpacks_to_gigabytes_is_damaged(
    tmp_path: Path, compression: str, claimed: int
) -> None:
    path = bomb(tmp_path, CHUNK_BYTES + 1, claimed, compression)

    with pytest.raises(LogError, match=f"unpacks to more than 128 MiB.*{VARIABLE}.*recover"):
        list(LogReader(path).records())


def test_recovery_goes_on_after_a_chunk_that_unpacks_to_gigabytes(tmp_path: Path) -> None:
    path = bomb(tmp_path, CHUNK_BYTES + 1, CHUNK_BYTES + 1, "zstd")

    saved = recover(path, tmp_path / "saved.mcap")

    assert len(saved.damaged) == 1
    assert "unpacks to more than 128 MiB" in saved.damaged[0]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("x = " + "9" * 5000, "out of range"),
        (f"x = {2**63}", "64 bits"),
        ("x = " + "[" * 100_000, "nested"),
        ("x" + ".x" * 100_000 + " = 1", "nested"),
        ("[x" + ".x" * 100_000 + "]", "nested"),
        ("x = " + "[" * 100 + "]" * 100, "nested"),
        ("x = 1\n" * (1 << 20), "characters"),
    ],
)
def test_toml_that_nobody_writes_is_no_toml(text: str, what: str) -> None:
    with pytest.raises(tomllib.TOMLDecodeError, match=what):
        parsed(text)


def test_toml_that_people_write_is_read() -> None:
    text = "[a.b]\nx = [[1, 2], [3.5]]\ny = {z = -9223372036854775808}\n"

    assert parsed(text) == {"a": {"b": {"x": [[1, 2], [3.5]], "y": {"z": -(2**63)}}}}
