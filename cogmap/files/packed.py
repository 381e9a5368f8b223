"""Files packed by gzip, bzip2 or xz, or plain, read through a bound; and the arrays of .npz."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from cogmap.errors import UsageError
from cogmap.files.bounds import Budget, most_bytes, most_unpacked

SUFFIXES = ("", ".gz", ".bz2", ".xz")
DAMAGE = (OSError, EOFError, lzma.LZMAError, zlib.error)
"""What reading a packed file that is damaged raises."""

BLOCK_BYTES = 1 << 16
# A packed file is known by its first bytes: names may be wrong.
_OPENERS: dict[bytes, Callable[[Path], object]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}


class _Bounded(io.RawIOBase):
    """The bytes of `file`, as many as a budget has."""

    def __init__(self, file: IO[bytes], budget: Budget) -> None:
        self._file = file
        self._budget = budget

    def readable(self) -> bool:
        """Return that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read into a buffer. Raises BoundError."""
        view = memoryview(buffer)
        content = self._file.read(len(view))
        self._budget.take(len(content))
        view[: len(content)] = content
        return len(content)


def bounded(file: IO[bytes], budget: Budget) -> IO[bytes]:
    """Return the same file, of which as much can be read as a budget has."""
    return cast("IO[bytes]", io.BufferedReader(_Bounded(file, budget), BLOCK_BYTES))


@contextmanager
def opened(path: Path) -> Iterator[IO[bytes]]:
    """Open a file, unpacked. Reading raises BoundError, and one of DAMAGE."""
    with path.open("rb") as plain:
        beginning = plain.read(max(map(len, _OPENERS)))

    opener = next((of for magic, of in _OPENERS.items() if beginning.startswith(magic)), None)
    if opener is None:
        budget = Budget(path, "holds", most_bytes())
    else:
        budget = Budget(path, "unpacks to", most_unpacked(path.stat().st_size))
    with cast("IO[bytes]", opener(path) if opener else path.open("rb")) as file:
        yield bounded(file, budget)


def read_text(path: Path) -> str:
    """Return the text of a plain file in UTF-8. Raises BoundError, OSError, UnicodeDecodeError."""
    with path.open("rb") as file:
        return bounded(file, Budget(path, "holds")).read().decode()


def read_arrays(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    """Return the arrays of a .npz file by their names, none of Python's objects. Raises UsageError
    if they cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as packed:
            Budget(path, "unpacks to", most_unpacked(path.stat().st_size)).take(
                sum(each.file_size for each in packed.infolist())
            )
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except UsageError:
        raise
    except Exception as error:  # zip, zlib and NumPy raise what the nonsense in a file leads to
        words = " ".join(str(error).split()) or type(error).__name__
        raise UsageError(f"{path} holds no arrays ({words}): make it again") from None
