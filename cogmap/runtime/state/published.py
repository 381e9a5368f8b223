"""How many messages an instance has published in all its incarnations, kept on disk.

With these counts the messages of a restarted module go on from those of the incarnation before it,
also where nobody received its last ones: receivers then count them as lost.
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from pathlib import Path

from cogmap.errors import StorageError
from cogmap.runtime.state.files import open_file, write_at
from cogmap.schemas.topics import Topic

_RECORD = struct.Struct("<120sQ")
_COUNT = struct.Struct("<Q")
_COUNT_OFFSET = _RECORD.size - _COUNT.size


@dataclass
class _Slot:
    offset: int
    count: int


class PublishedCounts:
    """One count a topic. It survives a kill of this process from the moment it is raised.

    Raises StorageError where the file at `path` cannot be opened or written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = open_file(path)
        self._slots = self._read()
        self._earlier = {name: slot.count for name, slot in self._slots.items()}

    def earlier(self, topic: Topic) -> int:
        """How many messages of `topic` the earlier incarnations published."""
        return self._earlier.get(topic.name, 0)

    def add(self, topic: Topic) -> None:
        """Count one message of `topic` that is about to be published."""
        slot = self._slots.get(topic.name)
        if slot is None:
            slot = self._append(topic.name)
            self._slots[topic.name] = slot

        slot.count += 1
        data = _COUNT.pack(slot.count)
        offset = slot.offset + _COUNT_OFFSET
        write_at(self._path, self._file, data, offset)

    def close(self) -> None:
        """Close the file; the counts stay in it."""
        os.close(self._file)

    def _read(self) -> dict[str, _Slot]:
        slots: dict[str, _Slot] = {}
        offset = 0
        while True:
            data = os.pread(self._file, _RECORD.size, offset)
            if len(data) < _RECORD.size:
                return slots

            padded, count = _RECORD.unpack(data)
            name = self._decoded(padded)
            slots[name] = _Slot(offset, count)
            offset += _RECORD.size

    def _decoded(self, padded: bytes) -> str:
        try:
            return padded.rstrip(b"\0").decode()
        except UnicodeDecodeError:
            raise StorageError(
                f"{self._path} is damaged: move it away to count from the beginning"
            ) from None

    def _append(self, name: str) -> _Slot:
        offset = len(self._slots) * _RECORD.size
        write_at(self._path, self._file, _RECORD.pack(name.encode(), 0), offset)
        return _Slot(offset, 0)
