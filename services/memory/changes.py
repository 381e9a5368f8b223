"""What is to be stored."""

from __future__ import annotations

from typing import NamedTuple

from cogmap.schemas.memory import StoredRecord


class Changes(NamedTuple):
    """Records that are new or changed, and the keys of those that are no more."""

    records: list[StoredRecord]
    forgotten: list[str]
