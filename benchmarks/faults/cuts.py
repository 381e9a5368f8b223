"""Logs cut at any place: how much of what is whole in them is recovered."""

from __future__ import annotations

import struct
from collections import Counter
from pathlib import Path
from random import Random

from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from cogmap.recording.storage.recover import recover

MOST_BYTES = 32 * 2**20
"""Of a larger log, only the beginning is cut."""

# The magic bytes, before which there is no log.
_LEAST_BYTES = 8

Written = Counter[tuple[str, int, int, bytes]]
"""Messages by topic, number, time and bytes."""


def recovered_share(path: Path, cuts: int, random: Random, folder: Path) -> float:
    """Cut the log at `path` at random places, `cuts` of them, and recover each in `folder`.

    Returns the smallest share of the messages that a reader of the format finds whole, and which
    the recovered log holds; 1 where there is none.
    """
    with path.open("rb") as file:
        content = file.read(MOST_BYTES)
    shares = [1.0]
    for cut in range(cuts):
        cut_path = folder / f"{path.stem}-cut-{cut}.mcap"
        saved_path = folder / f"{path.stem}-saved-{cut}.mcap"
        cut_path.write_bytes(content[: random.randint(_LEAST_BYTES, len(content))])
        whole = messages_in(cut_path)
        recover(cut_path, saved_path)
        if whole:
            kept = whole & messages_in(saved_path)
            shares.append(kept.total() / whole.total())
        cut_path.unlink()
        saved_path.unlink()

    return min(shares)


def messages_in(path: Path) -> Written:
    """Count the messages up to where the file can be read, by the reader of the MCAP library."""
    found: Written = Counter()
    names: dict[int, str] = {}
    with path.open("rb") as file:
        try:
            for record in StreamReader(file).records:
                if isinstance(record, Channel):
                    names[record.id] = record.topic
                if isinstance(record, Message):
                    name = names[record.channel_id]
                    found[name, record.sequence, record.log_time, bytes(record.data)] += 1
        except (McapError, struct.error):
            pass  # the cut
    return found
