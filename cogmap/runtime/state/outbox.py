"""What an instance has published lately, on disk, for those who missed it."""

from __future__ import annotations

import os
import struct
import threading
import time
import zlib
from array import array
from bisect import bisect_left
from collections.abc import Iterator
from pathlib import Path

from cogmap.bus.depth import KEPT_S
from cogmap.bus.interface import Sent
from cogmap.runtime.state.files import open_file, write_at
from cogmap.schemas.topics import Topic

# The length of the body and its CRC-32, the lengths of the topic's name and of the envelope in it,
# and the number of the message.
HEAD = struct.Struct("<IIHIQ")
_MAX_NAME_BYTES = 256
FILE_BYTES = 256 * 2**20
"""The most that one of the two files takes, and one message more."""

PIECE_BYTES = 2**20
"""How much is read at once, and one message more: a slow link carries it in a second or two."""


class _File:
    """Messages in the order in which they were published, with an index by topic and number."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.size = 0
        self.began_s = time.monotonic()
        self._file = open_file(path)
        self._numbers: dict[str, array[int]] = {}
        self._offsets: dict[str, array[int]] = {}
        self._scan()

    def _scan(self) -> None:
        """Index what is there. A torn tail, left by a kill during a write, is cut off."""
        end = os.fstat(self._file).st_size
        while True:
            start = os.pread(self._file, HEAD.size + _MAX_NAME_BYTES, self.size)
            if len(start) < HEAD.size:
                break
            length, _, name_length, _, number = HEAD.unpack_from(start)
            if self.size + HEAD.size + length > end or name_length > _MAX_NAME_BYTES:
                break

            name = start[HEAD.size : HEAD.size + name_length].decode(errors="replace")
            self._note(name, number)
            self.size += HEAD.size + length
        os.ftruncate(self._file, self.size)

    def _note(self, name: str, number: int) -> None:
        """Index the message that begins at the end of the file."""
        self._numbers.setdefault(name, array("Q")).append(number)
        self._offsets.setdefault(name, array("Q")).append(self.size)

    def append(self, name: str, number: int, envelope: bytes, payload: bytes) -> None:
        """Write a message. Raises StorageError."""
        body = b"".join((name.encode(), envelope, payload))
        name_length = len(body) - len(envelope) - len(payload)
        head = HEAD.pack(len(body), zlib.crc32(body), name_length, len(envelope), number)

        write_at(self.path, self._file, head + body, self.size)
        self._note(name, number)
        self.size += HEAD.size + len(body)

    def read(self, name: str, first: int, last: int) -> Iterator[tuple[int, Sent]]:
        """Yield number and message of `first` to `last`, as far as they are here and whole."""
        numbers = self._numbers.get(name)
        if numbers is None:
            return
        for position in range(bisect_left(numbers, first), len(numbers)):
            number = numbers[position]
            if number > last:
                return
            found = self._at(self._offsets[name][position])
            if found is not None:
                yield number, found

    def _at(self, offset: int) -> Sent | None:
        head = os.pread(self._file, HEAD.size, offset)
        length, checksum, name_length, envelope_length, _ = HEAD.unpack(head)
        body = os.pread(self._file, length, offset + HEAD.size)
        if zlib.crc32(body) != checksum:
            return None
        end = name_length + envelope_length
        return Sent(body[end:], body[name_length:end])

    def rename(self, path: Path) -> None:
        """Take the place of the file at `path`."""
        self.path.replace(path)
        self.path = path

    def close(self) -> None:
        """Close the file; what is in it stays."""
        os.close(self._file)


class Outbox:
    """The messages of the last KEPT_S or more, at most about twice FILE_BYTES, in two files.

    Once the newer file is old or large enough it becomes the older one. Messages are found by topic
    and number; a restarted instance finds those of its earlier incarnations. A thread may read
    while another appends. Raises StorageError where the files cannot be opened.
    """

    def __init__(self, path: Path, file_bytes: int = FILE_BYTES) -> None:
        self._path = path
        self._file_bytes = file_bytes
        self._changing = threading.Lock()
        self._older = _File(path.with_suffix(f"{path.suffix}.older"))
        self._newer = _File(path)

    def append(self, topic: Topic, number: int, envelope: bytes, payload: bytes) -> None:
        """Keep a message of `topic`, whose number is higher than that of any before. It survives
        this process from here on. Raises StorageError if the disk is full.
        """
        with self._changing:
            age_s = time.monotonic() - self._newer.began_s
            if age_s > KEPT_S or self._newer.size >= self._file_bytes:
                self._turn()
            self._newer.append(topic.name, number, envelope, payload)

    def _turn(self) -> None:
        self._older.close()
        self._newer.rename(self._older.path)
        self._older = self._newer
        self._newer = _File(self._path)

    def read(self, topic: Topic, first: int, last: int) -> list[Sent]:
        """Return the messages of `topic` with numbers from `first` to `last`, in order: as far as
        they are kept, and no more than fit into PIECE_BYTES, but one at least.
        """
        found: list[Sent] = []
        size = 0
        with self._changing:
            for file in (self._older, self._newer):
                for _, sent in file.read(topic.name, first, last):
                    if found and size + len(sent.payload) > PIECE_BYTES:
                        return found
                    found.append(sent)
                    size += len(sent.payload) + len(sent.envelope)
        return found

    def close(self) -> None:
        """Close the files; what is in them stays."""
        with self._changing:
            self._older.close()
            self._newer.close()
