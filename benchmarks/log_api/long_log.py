"""A log of 1 GB: the messages of a drive, over and over."""

from __future__ import annotations

from pathlib import Path

from cogmap.recording.storage import format as layout
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.writer import FLUSH_S, LogWriter

LONG_BYTES = 10**9


def lengthen(source: Path, target: Path) -> None:
    """Write the messages of `source` to `target` until that has LONG_BYTES, each time later by the
    time that they lasted, in chunks as a recorder would. Raises LogError.
    """
    reader = LogReader(source)
    writer = LogWriter(target, layout.topics_to_record(), {"config": "{}"})
    first_ns, last_ns = reader.span_ns
    later_ns = 0
    flushed_ns = first_ns

    while target.stat().st_size < LONG_BYTES:
        for record in reader.records():
            at_ns = record.log_time_ns + later_ns
            writer.write(record.topic, reader.payload(record), record.envelope, at_ns)
            if at_ns - flushed_ns >= FLUSH_S * 1e9:
                writer.flush()
                flushed_ns = at_ns
        later_ns += last_ns - first_ns + 1
    writer.close()
