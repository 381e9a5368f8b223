"""What a module has committed, on disk before it is sent, so that a kill loses none of it."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from cogmap.bus.codec import decode, encode
from cogmap.errors import MessageError, UsageError
from schemas import topics
from schemas.base import Message

_HEAD = struct.Struct("<IIH")
COMPACT_BYTES = 64 * 2**20


class Journal:
    """An append-only file of messages. A torn tail, left by a kill amid a write, is cut off when it
    is opened.

    Raises UsageError where it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise UsageError(
                f"cannot write {path} ({error.strerror}): name another folder with --state"
            ) from None
        self._size = 0
        self._limit = COMPACT_BYTES

    def messages(self) -> Iterator[Message]:
        """Everything written so far, oldest first. Raises UsageError at a whole record that cannot
        be read.
        """
        while (record := self._record_at(self._size)) is not None:
            message, length = record
            self._size += length
            yield message
        os.ftruncate(self._file, self._size)

    def _record_at(self, offset: int) -> tuple[Message, int] | None:
        head = os.pread(self._file, _HEAD.size, offset)
        if len(head) < _HEAD.size:
            return None
        length, checksum, name_length = _HEAD.unpack(head)
        body = os.pread(self._file, length, offset + _HEAD.size)
        if len(body) < length or zlib.crc32(body) != checksum:
            return None
        try:
            topic = topics.BY_NAME[body[:name_length].decode()]
            return decode(topic, body[name_length:]), _HEAD.size + length
        except (KeyError, UnicodeDecodeError, MessageError) as error:
            raise UsageError(
                f"{self._path}: a record of another version cannot be read ({error}): move the file away to start anew"
            ) from None

    def append(self, message: Message, payload: bytes) -> None:
        """Write `message`, whose bytes are `payload`; it survives this process from here on."""
        name = topics.of(message).name.encode()
        body = name + payload
        record = _HEAD.pack(len(body), zlib.crc32(body), len(name)) + body
        os.pwrite(self._file, record, self._size)
        self._size += len(record)

    @property
    def is_empty(self) -> bool:
        """Whether there was nothing to read, and nothing has been written."""
        return self._size == 0

    @property
    def is_long(self) -> bool:
        """Whether it is time to put one message in place of all."""
        return self._size > self._limit

    def compact(self, message: Message) -> None:
        """Put `message` in place of everything, at once or not at all."""
        fresh = Journal(self._path.with_suffix(".new"))
        os.ftruncate(fresh._file, 0)
        fresh.append(message, encode(message))
        fresh._path.replace(self._path)
        os.close(self._file)
        self._file = fresh._file
        self._size = fresh._size
        self._limit = max(COMPACT_BYTES, 4 * self._size)

    def close(self) -> None:
        """Close the file; what is in it stays."""
        os.close(self._file)
