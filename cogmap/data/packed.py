"""Files as they are, or packed by gzip, bzip2 or xz, as the ends of their names tell."""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Iterator
from pathlib import Path
from typing import IO, cast

from cogmap.errors import UsageError


def lines(path: Path, give: str) -> Iterator[bytes]:
    """The lines of a file, unpacked.

    Raises UsageError where it cannot be read; its remedy is to give `give`.
    """
    try:
        with _opened(path) as file:
            yield from file
    except (OSError, EOFError, lzma.LZMAError) as error:
        raise UsageError(
            f"{path} cannot be read ({error}): give {give}, plain or packed"
        ) from error


def _opened(path: Path) -> IO[bytes]:
    match path.suffix:
        case ".gz":
            return cast("IO[bytes]", gzip.open(path, "rb"))
        case ".bz2":
            return bz2.open(path, "rb")
        case ".xz":
            return lzma.open(path, "rb")
    return path.open("rb")
