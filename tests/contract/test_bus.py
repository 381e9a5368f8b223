"""What every bus promises."""

from __future__ import annotations

import re
import threading
from queue import SimpleQueue

import pytest

from cogmap.bus.codec import Envelope, decode
from cogmap.bus.interface import Answer, Job, Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import NoAnswerError, UsageError
from schemas import topics
from schemas.examples import example_messages
from schemas.process import Clock
from schemas.sensing import Odometry
from schemas.topics import Delivery
from tests.support.networks import TIMEOUT_S, Network, OverZenoh, Peer, meet, publish

MESSAGES = {topics.of(message): message for message in example_messages()}
TRAVELLING = [topic for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST]
SNAPSHOTS = (topics.SNAPSHOT_REQUEST, topics.SNAPSHOT)
ENVELOPE = Envelope("workspace", 0, 7, 2, 1)


def odometry(seq: int, source: str = "sim") -> Odometry:
    return Odometry(
        speed_m_s=1.0, turn_rate_rad_s=0.0, dt_s=0.05, seq=seq, source=source, stamp_ns=seq
    )


def clock(seq: int) -> Clock:
    return Clock(seq=seq, source="sim", stamp_ns=seq)


@pytest.mark.parametrize("topic", TRAVELLING, ids=lambda topic: topic.name)
def test_a_message_of_every_topic_arrives_whole(network: Network, topic: topics.Topic) -> None:
    publisher = network.join()
    subscriber = network.join()
    publisher.declare(topic)
    peer = Peer(subscriber, topic)
    meet(publisher, subscriber)

    publish(publisher, MESSAGES[topic])

    (arrival,) = peer.take(1)
    assert decode(topic, arrival.payload) == MESSAGES[topic]
    assert arrival.envelope is not None
    assert (arrival.envelope.source, arrival.envelope.seq) == (
        MESSAGES[topic].source,
        MESSAGES[topic].seq,
    )


def test_2000_never_drop_messages_arrive_in_order_at_every_subscriber(
    network: Network,
) -> None:
    publisher, *subscribers = (network.join() for _ in range(4))
    publisher.declare(topics.ODOMETRY)
    peers = [Peer(subscriber, topics.ODOMETRY) for subscriber in subscribers]
    meet(publisher, *subscribers)

    publish(publisher, *(odometry(seq) for seq in range(2000)))

    for peer in peers:
        assert peer.take_seqs(2000) == list(range(2000))
        assert len(peer.inbox) == 0


def test_a_slow_subscriber_receives_the_newest_and_counts_the_superseded(network: Network) -> None:
    publisher = network.join()
    subscriber = network.join()
    publisher.declare(topics.CLOCK)
    peer = Peer(subscriber, topics.CLOCK)
    meet(publisher, subscriber)

    publish(publisher, *(clock(seq) for seq in range(50)))
    peer.wait_for(50)

    (arrival,) = peer.take(1)
    assert decode(topics.CLOCK, arrival.payload) == clock(49)
    assert peer.inbox.superseded[topics.CLOCK.name] == 49
    assert len(peer.inbox) == 0


def test_the_newest_of_one_source_does_not_replace_that_of_another(network: Network) -> None:
    publisher = network.join()
    subscriber = network.join()
    publisher.declare(topics.CLOCK)
    peer = Peer(subscriber, topics.CLOCK)
    meet(publisher, subscriber)

    publish(publisher, Clock(source="left"), Clock(source="right"), Clock(source="left", seq=1))
    peer.wait_for(3)

    assert [(a.envelope.source, a.envelope.seq) for a in peer.take(2) if a.envelope] == [
        ("left", 1),
        ("right", 0),
    ]


def test_a_publisher_does_not_wait_for_an_idle_subscriber(network: Network) -> None:
    publisher = network.join()
    idle = network.join()
    busy = network.join()
    publisher.declare(topics.ODOMETRY)
    Peer(idle, topics.ODOMETRY)
    peer = Peer(busy, topics.ODOMETRY)
    meet(publisher, idle, busy)

    publish(publisher, *(odometry(seq) for seq in range(200)))

    assert len(peer.take(200)) == 200


def test_a_late_subscriber_receives_nothing_of_the_past(network: Network) -> None:
    publisher = network.join()
    early = network.join()
    publisher.declare(topics.ODOMETRY)
    peer = Peer(early, topics.ODOMETRY)
    meet(publisher, early)
    publish(publisher, *(odometry(seq) for seq in range(50)))
    peer.wait_for(50)

    late = Peer(network.join(), topics.ODOMETRY)
    meet(publisher, late.bus)
    assert late.inbox.take(0.3) is None
    publish(publisher, odometry(50))

    assert late.take_seqs(1) == [50]


def test_a_subscriber_with_history_receives_the_last_messages_first(network: Network) -> None:
    publishers = [network.join(), network.join()]
    early = network.join()
    peer = Peer(early, topics.ODOMETRY)
    for publisher in publishers:
        publisher.declare(topics.ODOMETRY)
    meet(publishers[0], early)
    meet(publishers[1], early)
    for source, publisher in zip(("left", "right"), publishers, strict=True):
        publish(publisher, *(odometry(seq, source) for seq in range(50)))
    peer.wait_for(100)

    late = Peer(network.join(), topics.ODOMETRY, history=30)
    late.wait_for(60)
    meet(publishers[0], late.bus)
    publish(publishers[0], odometry(50, "left"))

    heard = [arrival.envelope for arrival in late.take(61) if arrival.envelope]
    assert [envelope.seq for envelope in heard if envelope.source == "left"] == list(range(20, 51))
    assert [envelope.seq for envelope in heard if envelope.source == "right"] == list(range(20, 50))
    assert len(late.inbox) == 0


def test_the_history_of_a_publisher_that_left_is_gone(network: Network) -> None:
    gone = network.join()
    early = network.join()
    gone.declare(topics.ODOMETRY)
    peer = Peer(early, topics.ODOMETRY)
    meet(gone, early)
    publish(gone, odometry(0))
    peer.wait_for(1)
    gone.close()

    assert Peer(network.join(), topics.ODOMETRY, history=30).inbox.take(0.3) is None


def work(job: Job) -> None:
    threading.Thread(target=job).start()


def test_a_query_is_answered(network: Network) -> None:
    asker = network.join()
    answerer = network.join()
    answerer.serve(*SNAPSHOTS, lambda payload: Answer(payload * 2, ENVELOPE), work)
    meet(asker, answerer)

    answer = asker.query(topics.SNAPSHOT_REQUEST, b"once", TIMEOUT_S)

    assert answer == Answer(b"onceonce", ENVELOPE)


def test_an_error_of_the_answerer_comes_back_in_words(network: Network) -> None:
    def refuse(payload: bytes) -> Answer:
        raise ValueError("no such version")

    asker = network.join()
    answerer = network.join()
    answerer.serve(*SNAPSHOTS, refuse, work)
    meet(asker, answerer)

    with pytest.raises(NoAnswerError, match="no such version"):
        asker.query(topics.SNAPSHOT_REQUEST, b"", TIMEOUT_S)


def test_a_query_without_an_answerer_raises(network: Network) -> None:
    with pytest.raises(NoAnswerError, match=r"nobody answers workspace/snapshot_request"):
        network.join().query(topics.SNAPSHOT_REQUEST, b"", 1.0)


def test_a_query_to_an_answerer_that_left_raises(network: Network) -> None:
    asker = network.join()
    answerer = network.join()
    answerer.serve(*SNAPSHOTS, Answer, work)
    gone: SimpleQueue[tuple[Member, bool]] = SimpleQueue()
    meet(asker, answerer)
    asker.watch(lambda member, alive: None if alive else gone.put((member, alive)))
    answerer.close()
    gone.get(timeout=TIMEOUT_S)

    with pytest.raises(NoAnswerError):
        asker.query(topics.SNAPSHOT_REQUEST, b"", 1.0)


def test_watchers_learn_who_is_there_comes_and_goes(network: Network) -> None:
    watcher = network.join()
    early = network.join()
    late = network.join()
    changes: SimpleQueue[tuple[Member, bool]] = SimpleQueue()
    first = Member("codelets", "codelets-1")
    second = Member("codelets", "codelets-2")

    early.announce(first)
    watcher.watch(lambda member, alive: changes.put((member, alive)))
    assert changes.get(timeout=TIMEOUT_S) == (first, True)
    late.announce(second)
    assert changes.get(timeout=TIMEOUT_S) == (second, True)
    early.close()
    assert changes.get(timeout=TIMEOUT_S) == (first, False)
    assert changes.empty()


@pytest.mark.parametrize("topic", TRAVELLING, ids=lambda topic: topic.name)
def test_a_plain_subscriber_reads_what_a_sample_holds(
    over_zenoh: OverZenoh, topic: topics.Topic
) -> None:
    publisher = over_zenoh.join()
    publisher.declare(topic)
    reader = over_zenoh.join()
    encodings: SimpleQueue[str] = SimpleQueue()
    reader.session.declare_subscriber(
        topic.key(over_zenoh.agent), lambda sample: encodings.put(str(sample.encoding))
    )
    meet(publisher, reader)

    publish(publisher, MESSAGES[topic])

    assert encodings.get(timeout=TIMEOUT_S) == f"application/msgpack;{topic.type.__name__}"


def test_a_plain_client_reads_what_queries_and_answers_hold(over_zenoh: OverZenoh) -> None:
    asker = over_zenoh.join()
    answerer = over_zenoh.join()
    answerer.serve(*SNAPSHOTS, Answer, work)
    meet(asker, answerer)
    key = topics.SNAPSHOT_REQUEST.key(over_zenoh.agent)

    (reply,) = asker.session.get(key, timeout=TIMEOUT_S)

    assert reply.ok is not None
    assert str(reply.ok.encoding) == "application/msgpack;Snapshot"


@pytest.mark.parametrize("name", ["a/b", "", "*", "a b", "robot?", "$x"])
def test_an_agent_that_cannot_be_in_a_key_names_itself(endpoint: str, name: str) -> None:
    with pytest.raises(UsageError, match=f"--agent {re.escape(repr(name))}: use letters, digits"):
        ZenohBus(endpoint, name)


def test_an_instance_that_cannot_be_in_a_key_names_itself(over_zenoh: OverZenoh) -> None:
    with pytest.raises(UsageError, match=r"--instance 'a/b': use letters, digits"):
        over_zenoh.join().announce(Member("codelets", "a/b"))
