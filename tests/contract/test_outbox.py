"""What an instance keeps of the messages that it published, and hands to those who missed them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cogmap.bus.codec import Envelope, decode_envelope, encode
from cogmap.bus.depth import CACHE_BYTES, KEPT_S, cached_messages, flow_of
from cogmap.bus.interface import Sent
from cogmap.errors import NoAnswerError, StorageError
from cogmap.runtime.state.outbox import HEAD, PIECE_BYTES, Outbox
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic
from tests.support.system.networks import Network, meet

TIMEOUT_S = 20.0
NEVER_DROP = [topic for topic in topics.ALL if topic.delivery is Delivery.NEVER_DROP]
LAST = 2**64 - 1


def envelope(number: int) -> bytes:
    return encode(Envelope("sim", number, 1, 2, 3, earlier=0))


def append(outbox: Outbox, numbers: range, topic: Topic = topics.ODOMETRY, size: int = 10) -> None:
    for number in numbers:
        outbox.append(topic, number, envelope(number), bytes(size))


def seqs(found: list[Sent]) -> list[int]:
    return [decode_envelope(sent.envelope).seq for sent in found]


@pytest.fixture
def outbox(tmp_path: Path) -> Iterator[Outbox]:
    outbox = Outbox(tmp_path / "sim.outbox")
    yield outbox
    outbox.close()


@pytest.mark.parametrize("topic", NEVER_DROP, ids=lambda topic: topic.name)
def test_a_cache_holds_five_minutes_or_as_much_as_its_room(topic: Topic) -> None:
    flow = flow_of(topic)
    kept = cached_messages(topic)

    assert kept * flow.size_bytes <= CACHE_BYTES
    is_long_enough = kept + 1 > flow.rate_hz * KEPT_S
    has_no_room = (kept + 1) * flow.size_bytes > CACHE_BYTES
    assert is_long_enough or has_no_room


def test_messages_are_found_by_topic_and_number(outbox: Outbox) -> None:
    append(outbox, range(10))
    append(outbox, range(5, 8), topics.DELTA)

    assert seqs(outbox.read(topics.ODOMETRY, 3, 6)) == [3, 4, 5, 6]
    assert seqs(outbox.read(topics.DELTA, 0, LAST)) == [5, 6, 7]
    assert outbox.read(topics.PERCEPTS, 0, LAST) == []
    assert outbox.read(topics.ODOMETRY, 10, LAST) == []


def test_a_message_comes_back_as_it_was_published(outbox: Outbox) -> None:
    outbox.append(topics.ODOMETRY, 3, b"envelope", b"payload")

    assert outbox.read(topics.ODOMETRY, 3, 3) == [Sent(b"payload", b"envelope")]


def test_a_large_hole_is_filled_in_pieces(outbox: Outbox) -> None:
    append(outbox, range(5), size=PIECE_BYTES // 2)

    assert seqs(outbox.read(topics.ODOMETRY, 0, LAST)) == [0]
    assert seqs(outbox.read(topics.ODOMETRY, 1, LAST)) == [1]


def test_a_restarted_instance_has_what_it_published_before(tmp_path: Path) -> None:
    before = Outbox(tmp_path / "sim.outbox")
    append(before, range(5))
    before.close()

    after = Outbox(tmp_path / "sim.outbox")
    append(after, range(5, 8))

    assert seqs(after.read(topics.ODOMETRY, 0, LAST)) == list(range(8))
    after.close()


@pytest.mark.parametrize("cut_bytes", [1, HEAD.size, HEAD.size + 20])
def test_a_message_that_was_cut_off_by_a_kill_is_not_read(tmp_path: Path, cut_bytes: int) -> None:
    path = tmp_path / "sim.outbox"
    before = Outbox(path)
    append(before, range(5))
    before.close()
    path.write_bytes(path.read_bytes()[:-cut_bytes])

    after = Outbox(path)
    append(after, range(5, 6))

    assert seqs(after.read(topics.ODOMETRY, 0, LAST)) == [0, 1, 2, 3, 5]
    after.close()


def test_a_damaged_message_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "sim.outbox"
    before = Outbox(path)
    append(before, range(2))
    before.close()
    damaged = bytearray(path.read_bytes())
    damaged[-1] ^= 1
    path.write_bytes(damaged)

    after = Outbox(path)

    assert seqs(after.read(topics.ODOMETRY, 0, LAST)) == [0]
    after.close()


def test_it_takes_a_bounded_room_on_the_disk(tmp_path: Path) -> None:
    outbox = Outbox(tmp_path / "sim.outbox", file_bytes=10_000)

    append(outbox, range(100), size=1000)

    sizes = [path.stat().st_size for path in tmp_path.iterdir()]
    assert sum(sizes) < 23_000
    kept = seqs(outbox.read(topics.ODOMETRY, 0, LAST))
    assert kept == list(range(kept[0], 100))
    assert len(kept) >= 10
    outbox.close()


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")

    with pytest.raises(StorageError, match="--state"):
        Outbox(tmp_path / "state" / "sim.outbox")


def test_a_source_answers_for_what_it_published(network: Network, outbox: Outbox) -> None:
    asker = network.join()
    source = network.join()
    append(outbox, range(10))
    source.serve_past(topics.ODOMETRY, "sim", outbox.read)
    meet(asker, source)

    found = asker.fetch_past(topics.ODOMETRY, "sim", 4, 6, TIMEOUT_S)

    numbers = [each.envelope.seq for each in found if each.envelope is not None]
    assert numbers == [4, 5, 6]
    assert {each.topic for each in found} == {topics.ODOMETRY}
    assert [bytes(each.payload) for each in found] == [bytes(10)] * 3


@pytest.mark.parametrize("source", ["nobody", "no/name*"])
def test_a_source_that_is_not_there_does_not_answer(network: Network, source: str) -> None:
    with pytest.raises(NoAnswerError):
        network.join().fetch_past(topics.ODOMETRY, source, 0, 9, TIMEOUT_S)


def test_a_source_that_has_kept_none_says_so(network: Network, outbox: Outbox) -> None:
    asker = network.join()
    source = network.join()
    source.serve_past(topics.ODOMETRY, "sim", outbox.read)
    meet(asker, source)

    assert asker.fetch_past(topics.ODOMETRY, "sim", 4, 6, TIMEOUT_S) == []


def test_a_source_that_has_left_does_not_answer(network: Network, outbox: Outbox) -> None:
    asker = network.join()
    source = network.join()
    append(outbox, range(10))
    source.serve_past(topics.ODOMETRY, "sim", outbox.read)
    meet(asker, source)
    source.close()

    with pytest.raises(NoAnswerError):
        asker.fetch_past(topics.ODOMETRY, "sim", 0, 9, TIMEOUT_S)
