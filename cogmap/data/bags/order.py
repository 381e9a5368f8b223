"""The order of messages in time, by their stamps."""

from __future__ import annotations

from typing import Any

import numpy as np

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Indices

NS_PER_S = 1_000_000_000

LATE_NS = 1_000_000_000
"""Messages may overtake each other by so much; a stamp that goes back farther is of another clock,
or of another drive.
"""


def stamp_ns_of(message: Any) -> int:
    """Return the stamp of a message's header, 0 if nobody set it."""
    stamp = message.header.stamp
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


def in_order(stamps_ns: Indices, source: str) -> tuple[Indices, list[str]]:
    """Return the order of (n,) stamps in time, each one once, and sentences on what was wrong.

    Raises UsageError if one goes back by more than LATE_NS.
    """
    behind_ns = np.maximum.accumulate(stamps_ns) - stamps_ns
    if behind_ns.max(initial=0) > LATE_NS:
        number = int(behind_ns.argmax())
        raise UsageError(
            f"{source}: the stamp of message {number} goes back by {behind_ns[number] / 1e9:.1f} "
            "s: give a bag of one drive, stamped by one clock"
        )

    _, order = np.unique(stamps_ns, return_index=True)
    late = int(np.count_nonzero(behind_ns))
    repeated = len(stamps_ns) - len(order)
    notes = []
    if late > 0:
        notes.append(f"{source}: {late} stamps went back, and were put in order")
    if repeated:
        notes.append(f"{source}: {repeated} messages with the stamp of another are left out")
    return order.astype(np.int64), notes
