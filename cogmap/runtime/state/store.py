"""What long-term memory keeps between runs: its messages as records of a database."""

from __future__ import annotations

from pathlib import Path

import msgspec

from cogmap.bus.codec import encode
from cogmap.errors import StorageError
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record
from cogmap.schemas.memory import Restored, Stored, StoredRecord, kind_of_record

DECODER: msgspec.msgpack.Decoder[StoredRecord] = msgspec.msgpack.Decoder(StoredRecord)


class Store:
    """The database at `path`. Raises StorageError if it cannot be opened, read or written."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._database = Database(path)

    def restored(self) -> Restored:
        """Return all that it holds."""
        records = []
        for record in self._database.records():
            try:
                records.append(DECODER.decode(record.payload))
            except msgspec.DecodeError as error:
                raise StorageError(
                    f"{self._path}: record {record.key} is of another version ({error}): "
                    "use the version of cogmap that wrote it, or another file"
                ) from None

        return Restored(records=records)

    def save(self, stored: Stored) -> None:
        """Put the records of a message on the disk, and remove those that it forgets."""
        self._database.put(
            Record(each.key, kind_of_record(each), encode(each)) for each in stored.records
        )
        if stored.forgotten:
            self._database.remove(stored.forgotten)

    def close(self) -> None:
        """Let others open the database."""
        self._database.close()
