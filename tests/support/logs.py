"""Logs written for a test, message by message."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from cogmap.bus.codec import Envelope, encode
from cogmap.recording.storage.format import topics_to_record
from cogmap.recording.storage.writer import LogWriter
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import AnyNode
from cogmap.schemas.sensing import RangeScan

SECOND_NS = 10**9
ABOUT = {"agent": "a", "config": "{}", "began_ns": "1"}
Row = tuple[int, Message]


def write_log(path: Path, rows: Iterable[Row], *, incarnation: int = 1, **about: str) -> Path:
    """A finished log of messages, each with the time in ns of its publishing and receipt."""
    writer = LogWriter(path, topics_to_record(), {**ABOUT, **about})
    for at_ns, message in rows:
        envelope = Envelope(message.source, message.seq, incarnation, at_ns, at_ns)
        writer.write(topics.of(message), encode(message), envelope, at_ns)
    writer.close()
    return path


def scan(seq: int, *, stamp_ns: int = 0, values: Array | None = None) -> RangeScan:
    """A scan whose ranges are its number, or `values`."""
    if values is None:
        values = Array.of(np.full(8, seq, np.float32))
    return RangeScan(
        seq=seq,
        stamp_ns=stamp_ns,
        source="sensory",
        frame=seq,
        bearing_rad=values,
        range_m=values,
    )


def delta(version: int, *nodes: AnyNode) -> Delta:
    """The commit of that number, which puts these nodes."""
    return Delta(
        seq=version,
        source="workspace",
        version=version,
        cycle=version,
        phase=Phase.END,
        operations=list(nodes),
    )
