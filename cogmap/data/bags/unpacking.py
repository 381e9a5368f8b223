"""Bounds for the library of bags, which has none: on what it unpacks, what SQLite may do, and how
deep metadata are nested.
"""

from __future__ import annotations

import bz2
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from typing import IO, Any

import lz4.frame
import zstandard

from cogmap.data.text import read_bytes
from cogmap.errors import UsageError
from cogmap.files.bounds import MIB, Budget, most_unpacked
from cogmap.files.packed import bounded
from cogmap.files.yaml import TOO_DEEP, is_too_deep

MAX_WINDOW_BYTES = 128 * MIB
FLOOR_BYTES = 128 * MIB
"""Every chunk may unpack to this, as those of our logs."""


def unpacked_bz2(data: bytes, size: int = 0) -> bytes:
    """Unpack what bzip2 has packed. Raises BoundError."""
    most = _most(data, size)
    return _checked(bz2.BZ2Decompressor().decompress(data, max_length=most + 1), most)


def unpacked_lz4(data: bytes, size: int = 0) -> bytes:
    """Unpack what LZ4 has packed. Raises BoundError."""
    most = _most(data, size)
    opener = lz4.frame.LZ4FrameDecompressor()
    return _checked(opener.decompress(data, max_length=most + 1), most)


def unpacked_zstd(data: bytes, size: int = 0) -> bytes:
    """Unpack what Zstandard has packed. Raises BoundError."""
    most = _most(data, size)
    opener = zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW_BYTES)
    with opener.stream_reader(data, read_across_frames=True) as file:
        return _checked(file.read(most + 1), most)


def opened_zstd(file: IO[bytes], mode: str = "rb") -> IO[bytes]:
    """Open a file that Zstandard has packed. Reading raises BoundError."""
    size = Path(file.name).stat().st_size
    opener = zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW_BYTES)
    stream = opener.stream_reader(file, read_across_frames=True)
    return bounded(stream, Budget(file.name, "unpacks to", most_unpacked(size, FLOOR_BYTES)))


def bound(reader1: Any, reader2: Any, storage: Any) -> None:
    """Put these in the place of what rosbags unpacks by, in its modules `rosbag1.reader`,
    `rosbag2.reader` and `rosbag2.storage_mcap`.
    """
    reader1.decompressors |= {"bz2": unpacked_bz2, "lz4": unpacked_lz4}
    storage.DECOMPRESSORS |= {"lz4": unpacked_lz4, "zstd": unpacked_zstd}
    reader2.zstd = _Zstd


class _Zstd:
    """What rosbags takes of the module `zstd`."""

    decompress = staticmethod(unpacked_zstd)
    open = staticmethod(opened_zstd)


def check_databases(path: Path) -> None:
    """Raise UsageError if an SQLite file of a bag has more than tables and indexes: a view may give
    rows without end.
    """
    for file in sorted(path.glob("*.db3")) if path.is_dir() else [path]:
        # What is no database is for the library to say.
        with suppress(sqlite3.Error), closing(_connected(file)) as connection:
            rows = connection.execute("SELECT name, type, sql FROM sqlite_schema LIMIT 100")
            for name, kind, sql in rows:
                is_plain = kind == "index" or str(sql).upper().startswith("CREATE TABLE")
                if not is_plain:
                    raise UsageError(
                        f"{file} has a {str(kind)[:20]} {str(name)[:60]!r}, which no bag has: "
                        "record it again, or copy its tables into a new file"
                    )


def check_metadata(path: Path) -> None:
    """Raise UsageError if the metadata of a bag of ROS 2 cannot be read, or are nested too deep."""
    file = path / "metadata.yaml"
    if not file.is_file():
        return
    text = read_bytes(file, "a bag that you may read").decode("utf-8", "replace")
    if is_too_deep(text):
        raise UsageError(f"{file} is damaged ({TOO_DEEP}): make it anew by `ros2 bag reindex`")


def _connected(file: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro&immutable=1", uri=True)


def _most(data: bytes, size: int) -> int:
    most = most_unpacked(len(data), FLOOR_BYTES)
    Budget("a chunk", "unpacks to", most).take(size)
    return most


def _checked(content: bytes, most: int) -> bytes:
    Budget("a chunk", "unpacks to", most).take(len(content))
    return content
