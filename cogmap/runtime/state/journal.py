"""What a module has committed, on disk before it is published, so that a kill loses none of it."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from cogmap.bus.codec import decode, encode
from cogmap.errors import MessageError, UsageError
from cogmap.runtime.state.files import open_file, write_at
from cogmap.schemas import topics
from cogmap.schemas.base import Message

# The length of the body, its CRC-32, and the length of the topic's name in it.
HEAD = struct.Struct("<IIH")
COMPACT_BYTES = 8 * 2**20
"""To read and apply so much takes a workspace a quarter of a second when it is restarted."""
# No topic has larger messages.
MAX_BODY_BYTES = 2 * max(topic.max_bytes for topic in topics.ALL)


class Journal:
    """An append-only file of messages.

    A torn tail, left by a kill during a write, is cut off when the file is read. Raises
    StorageError where the file cannot be opened or written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = open_file(path)
        self._size = 0
        self._limit = COMPACT_BYTES

    def messages(self) -> Iterator[Message]:
        """Yield everything written so far, oldest first.

        Raises UsageError at a whole record that cannot be decoded.
        """
        while (body := self._body_at(self._size)) is not None:
            name_length, record = body
            try:
                topic = topics.BY_NAME[record[:name_length].decode()]
                message = decode(topic, record[name_length:])
            except (KeyError, UnicodeDecodeError, MessageError) as error:
                raise UsageError(
                    f"{self._path}: a record of another version cannot be read ({error}): "
                    f"move the file away to start anew"
                ) from None

            self._size += HEAD.size + len(record)
            yield message
        os.ftruncate(self._file, self._size)

    def _body_at(self, offset: int) -> tuple[int, bytes] | None:
        """Read the length of the topic's name, then name and payload; None if none is whole."""
        head = os.pread(self._file, HEAD.size, offset)
        if len(head) < HEAD.size:
            return None

        length, checksum, name_length = HEAD.unpack(head)
        if length > MAX_BODY_BYTES:
            return None
        body = os.pread(self._file, length, offset + HEAD.size)
        if len(body) < length or zlib.crc32(body) != checksum:
            return None
        return name_length, body

    def append(self, message: Message, payload: bytes) -> None:
        """Write `message`, whose bytes are `payload`; it survives this process from here on."""
        name = topics.of(message).name.encode()
        body = name + payload
        head = HEAD.pack(len(body), zlib.crc32(body), len(name))

        write_at(self._path, self._file, head + body, self._size)
        self._size += HEAD.size + len(body)

    @property
    def is_empty(self) -> bool:
        """Return whether there was nothing to read, and nothing has been written."""
        return self._size == 0

    @property
    def is_long(self) -> bool:
        """Return whether it is time to compact it."""
        return self._size > self._limit

    def compact(self, message: Message) -> None:
        """Replace everything by `message`, atomically."""
        new_path = self._path.with_suffix(".new")
        new = Journal(new_path)
        os.ftruncate(new._file, 0)
        new.append(message, encode(message))
        new_path.replace(self._path)

        os.close(self._file)
        self._file = new._file
        self._size = new._size
        self._limit = max(COMPACT_BYTES, 4 * self._size)

    def close(self) -> None:
        """Close the file; what is in it stays."""
        os.close(self._file)
