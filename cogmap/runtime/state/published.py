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

SUFFIX = ".published"
# The name of a topic, padded with zeros, and the count.
RECORD = struct.Struct("<120sQ")
COUNT = struct.Struct("<Q")
MAX_TOPICS = 10_000


@dataclass
class _Slot:
    offset: int
    count: int


class PublishedCounts:
    """One count a topic. It survives a kill of this process from the moment it is raised.

    Raises StorageError if the file at `path` cannot be opened or written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = open_file(path)
        self._slots: dict[str, _Slot] = {}
        while len(data := os.pread(self._file, RECORD.size, self._size)) == RECORD.size:
            padded, count = RECORD.unpack(data)
            try:
                name = padded.rstrip(b"\0").decode()
            except UnicodeDecodeError:
                raise StorageError(
                    f"{path} is damaged: move it away to count from the beginning"
                ) from None
            if name in self._slots or len(self._slots) == MAX_TOPICS:
                raise StorageError(f"{path} is damaged: move it away to count from the beginning")
            self._slots[name] = _Slot(self._size, count)

        self._earlier = {name: slot.count for name, slot in self._slots.items()}

    def earlier(self, topic: Topic) -> int:
        """Return how many messages of `topic` the earlier incarnations published."""
        return self._earlier.get(topic.name, 0)

    def totals(self) -> dict[str, int]:
        """Return by topic how many messages all incarnations have published."""
        return {name: slot.count for name, slot in self._slots.items()}

    def add(self, topic: Topic) -> None:
        """Count one message of `topic` that is about to be published."""
        slot = self._slots.get(topic.name)
        if slot is None:
            slot = _Slot(self._size, 0)
            write_at(self._path, self._file, RECORD.pack(topic.name.encode(), 0), slot.offset)
            self._slots[topic.name] = slot

        slot.count += 1
        data = COUNT.pack(slot.count)
        write_at(self._path, self._file, data, slot.offset + RECORD.size - COUNT.size)

    @property
    def _size(self) -> int:
        """Return how many bytes the records in the file take."""
        return len(self._slots) * RECORD.size

    def close(self) -> None:
        """Close the file; the counts stay in it."""
        os.close(self._file)


def published_in(folder: Path) -> dict[str, dict[str, int]]:
    """Return by instance and topic how many messages those that keep their state in `folder` have
    published. Raises StorageError if a file there is damaged.
    """
    found = {}
    for path in sorted(folder.glob(f"*{SUFFIX}")):
        counts = PublishedCounts(path)
        found[path.name.removesuffix(SUFFIX)] = counts.totals()
        counts.close()
    return found
