"""What rmw_zenoh attaches to each message: its number, its time, and who published it.

33 bytes: int64 number, int64 ns since 1970, the byte 16, and 16 bytes of the publisher's gid. A
peer that finds other bytes ends itself.
"""

from __future__ import annotations

import struct
from collections import Counter
from typing import NamedTuple

from cogmap.errors import MessageError

GID_BYTES = 16
LAYOUT = struct.Struct(f"<qqB{GID_BYTES}s")


class Attachment(NamedTuple):
    """The number of a message, from 1 on, when it was published, and the gid of its publisher."""

    number: int
    sent_ns: int
    gid: bytes

    @property
    def encoded(self) -> bytes:
        """Return it as it travels."""
        return LAYOUT.pack(self.number, self.sent_ns, GID_BYTES, self.gid)


def decoded(content: bytes) -> Attachment:
    """Read an attachment. Raises MessageError if it is none."""
    if len(content) != LAYOUT.size or content[2 * 8] != GID_BYTES:
        raise MessageError(
            f"an attachment of {len(content)} bytes, where rmw_zenoh has {LAYOUT.size}: publish by "
            "a rmw_zenoh of ROS 2 Jazzy or later"
        )
    number, sent_ns, _, gid = LAYOUT.unpack(content)
    return Attachment(number, sent_ns, gid)


def gid_of(token: str) -> bytes:
    """Return the gid of the publisher that a token announces: the token's XXH3, 128 bits, little
    endian.
    """
    import xxhash

    return xxhash.xxh3_128(token.encode()).intdigest().to_bytes(GID_BYTES, "little")


class Gaps:
    """Counts what is missing between the messages of each publisher."""

    def __init__(self) -> None:
        self._last: dict[bytes, int] = {}
        self.missing: Counter[str] = Counter()

    def update(self, topic: str, attachment: Attachment) -> None:
        """Take account of a message on a topic."""
        last = self._last.get(attachment.gid)
        if last is not None:
            self.missing[topic] += max(0, attachment.number - last - 1)
        self._last[attachment.gid] = attachment.number
