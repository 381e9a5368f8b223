"""What is attached to each message."""

from __future__ import annotations

import pytest
import xxhash
from zenoh_ros2_sdk import attachment as theirs

from cogmap.errors import MessageError
from cogmap.ros2.rmw.attachment import Attachment, Gaps, decoded, gid_of

GID = bytes(range(16))


def test_an_attachment_has_33_bytes_in_the_order_of_the_design() -> None:
    content = Attachment(1, 2, GID).encoded

    assert content == bytes([1, *[0] * 7, 2, *[0] * 7, 16]) + GID
    assert decoded(content) == Attachment(1, 2, GID)


def test_another_library_reads_ours_and_we_read_theirs() -> None:
    ours = Attachment(7, 1_700_000_000_000_000_000, GID)
    read = theirs.Attachment.from_bytes(ours.encoded)

    assert (read.sequence_id, read.timestamp_ns, read.gid) == tuple(ours)
    assert decoded(read.to_bytes()) == ours


@pytest.mark.parametrize(
    "content", [b"", bytes(32), bytes(34), bytes(33), Attachment(1, 2, GID).encoded + b"x"]
)
def test_other_bytes_are_refused_by_a_sentence(content: bytes) -> None:
    with pytest.raises(MessageError, match=f"an attachment of {len(content)} bytes"):
        decoded(content)


def test_the_gid_is_the_hash_of_the_token_little_endian() -> None:
    token = "@ros2_lv/0/abc/0/1/MP/%/%/talker"

    assert gid_of(token) == xxhash.xxh3_128(token.encode()).digest()[::-1]


def test_what_is_missing_is_counted_by_publisher() -> None:
    gaps = Gaps()
    for number in (3, 4, 7):
        gaps.update("/odom", Attachment(number, 0, GID))
    for number in (1, 2):
        gaps.update("/odom", Attachment(number, 0, bytes(16)))

    assert gaps.missing["/odom"] == 2
