"""What every bus promises."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from functools import partial
from queue import SimpleQueue

import pytest
from msgspec.structs import replace

from cogmap.bus.codec import Envelope, decode
from cogmap.bus.interface import Answer, Bus, Incarnation, Job, Member
from cogmap.bus.zenoh_bus import BATCHED_BYTES, TRANSIT_S, ZenohBus
from cogmap.errors import NoAnswerError, UsageError
from cogmap.schemas import topics
from cogmap.schemas.examples import example_messages
from cogmap.schemas.process import Clock
from cogmap.schemas.topics import Delivery
from cogmap.testing import odometry
from tests.support.system.networks import TIMEOUT_S, Network, OverZenoh, Peer, meet, publish

MESSAGES = {topics.of(message): message for message in example_messages()}
TRAVELLING = [topic for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST]
NEVER_DROP = [topic for topic in TRAVELLING if topic.delivery is Delivery.NEVER_DROP]
SNAPSHOTS = (topics.SNAPSHOT_REQUEST, topics.SNAPSHOT)
ENVELOPE = Envelope("workspace", 0, 7, 2, 1)
# How long nothing arrives where nothing should.
SILENCE_S = 0.3


def clock(seq: int) -> Clock:
    return Clock(seq=seq, source="sim", stamp_ns=seq)


@pytest.mark.parametrize("topic", TRAVELLING, ids=lambda topic: topic.name)
def test_a_message_of_every_topic_arrives_whole(network: Network, topic: topics.Topic) -> None:
    message = MESSAGES[topic]
    publisher = network.join()
    subscriber = network.join()
    publisher.declare(topic)
    peer = Peer(subscriber, topic)
    meet(publisher, subscriber)

    publish(publisher, message)
    (arrival,) = peer.take(1)

    assert decode(topic, arrival.payload) == message
    assert arrival.envelope is not None
    assert arrival.envelope.source == message.source
    assert arrival.envelope.seq == message.seq


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

    first_left = Clock(source="left")
    second_left = Clock(source="left", seq=1)
    right = Clock(source="right")
    publish(publisher, first_left, right, second_left)
    peer.wait_for(3)

    clocks = [decode(topics.CLOCK, arrival.payload) for arrival in peer.take(2)]
    assert clocks == [second_left, right]


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
    assert late.inbox.take(SILENCE_S) is None

    publish(publisher, odometry(50))

    assert late.take_seqs(1) == [50]


def test_a_subscriber_with_history_receives_the_last_messages_first(network: Network) -> None:
    publishers = {"left": network.join(), "right": network.join()}
    early = Peer(network.join(), topics.ODOMETRY)
    for source, publisher in publishers.items():
        publisher.declare(topics.ODOMETRY)
        meet(publisher, early.bus)
        publish(publisher, *(odometry(seq, source=source) for seq in range(50)))
    early.wait_for(100)

    late = Peer(network.join(), topics.ODOMETRY, history=30)
    late.wait_for(60)
    meet(publishers["left"], late.bus)
    publish(publishers["left"], odometry(50, source="left"))

    seqs: dict[str, list[int]] = {"left": [], "right": []}
    for arrival in late.take(61):
        assert arrival.envelope is not None
        seqs[arrival.envelope.source].append(arrival.envelope.seq)
    assert seqs["left"] == list(range(20, 51))
    assert seqs["right"] == list(range(20, 50))
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

    late = Peer(network.join(), topics.ODOMETRY, history=30)
    assert late.inbox.take(SILENCE_S) is None


def work(job: Job) -> None:
    threading.Thread(target=job).start()


def work_aside(job: Job) -> None:
    """Do a job as a shell does: on no thread of the bus."""
    threading.Thread(target=job).start()


def test_a_query_is_answered(network: Network) -> None:
    asker = network.join()
    answerer = network.join()
    answerer.claim(Incarnation("workspace", ENVELOPE.source, ENVELOPE.incarnation))
    answerer.serve(*SNAPSHOTS, lambda payload: Answer(payload * 2, ENVELOPE), work)
    meet(asker, answerer)

    answer = asker.query(topics.SNAPSHOT_REQUEST, b"once", TIMEOUT_S)

    assert answer == Answer(b"onceonce", ENVELOPE)


def test_a_large_answer_arrives_although_its_sender_asks_for_what_it_missed(
    over_zenoh: OverZenoh,
) -> None:
    asker = over_zenoh.join()
    answerer = over_zenoh.join()
    size_bytes = 60_000_000
    answerer.claim(Incarnation("workspace", ENVELOPE.source, ENVELOPE.incarnation))
    answerer.serve(*SNAPSHOTS, lambda payload: Answer(bytes(size_bytes), ENVELOPE), work_aside)
    publish_never_drop(asker)
    missed = Peer(answerer, *NEVER_DROP, history=1)
    missed.wait_for(len(NEVER_DROP))
    meet(asker, answerer)

    # It asks twice a second: some of these answers are under way then.
    sizes = set()
    for _ in range(12):
        answer = asker.query(topics.SNAPSHOT_REQUEST, b"", TIMEOUT_S)
        sizes.add(len(answer.payload))

    assert sizes == {size_bytes}


def publish_never_drop(bus: Bus) -> None:
    """One message on each such topic."""
    for topic in NEVER_DROP:
        bus.declare(topic)
        bus.publish(topic, b"payload", ENVELOPE)


def test_what_somebody_answers_who_is_not_on_the_bus_does_not_count(
    over_zenoh: OverZenoh,
) -> None:
    lie = Answer(b"lie", replace(ENVELOPE, source="nobody"))
    asker, answerer, *liars = (over_zenoh.join() for _ in range(4))
    for liar in liars:
        liar.serve(*SNAPSHOTS, partial(_always, lie), work)
        meet(asker, liar)
    with pytest.raises(NoAnswerError, match="was answered by somebody who is not on the bus"):
        asker.query(topics.SNAPSHOT_REQUEST, b"", TIMEOUT_S)

    answerer.claim(Incarnation("workspace", ENVELOPE.source, ENVELOPE.incarnation))
    answerer.serve(*SNAPSHOTS, partial(_always, Answer(b"truth", ENVELOPE)), work)
    meet(asker, answerer)

    for _ in range(5):
        assert asker.query(topics.SNAPSHOT_REQUEST, b"", TIMEOUT_S).payload == b"truth"


def test_of_two_unlike_answers_in_one_name_none_counts(over_zenoh: OverZenoh) -> None:
    asker, *answerers = (over_zenoh.join() for _ in range(3))
    answers = iter((Answer(b"truth", ENVELOPE), Answer(b"lie", ENVELOPE)))
    answerers[0].claim(Incarnation("workspace", ENVELOPE.source, ENVELOPE.incarnation))
    for answerer, answer in zip(answerers, answers, strict=True):
        answerer.serve(*SNAPSHOTS, partial(_always, answer), work)
        meet(asker, answerer)

    with pytest.raises(NoAnswerError, match="workspace gives unlike answers"):
        asker.query(topics.SNAPSHOT_REQUEST, b"", TIMEOUT_S)


def _always(answer: Answer, _: bytes) -> Answer:
    return answer


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
    quoted = re.escape(repr(name))

    with pytest.raises(UsageError, match=f"--agent {quoted}: use letters, digits"):
        ZenohBus(endpoint, name)


def test_a_program_that_fails_with_an_open_bus_ends(over_zenoh: OverZenoh) -> None:
    program = (
        "import sys\n"
        "from cogmap.bus.zenoh_bus import ZenohBus\n"
        "from cogmap.schemas import topics\n"
        "bus = ZenohBus(*sys.argv[1:])\n"
        "bus.subscribe(topics.CLOCK, print, print)\n"
        "raise RuntimeError('it fails')\n"
    )
    command = [sys.executable, "-c", program, over_zenoh.endpoint, over_zenoh.agent]

    ended = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)

    assert ended.returncode == 1
    assert ended.stderr.endswith("RuntimeError: it fails\n")


def test_an_instance_that_cannot_be_in_a_key_names_itself(over_zenoh: OverZenoh) -> None:
    bus = over_zenoh.join()

    with pytest.raises(UsageError, match=r"--instance 'a/b': use letters, digits"):
        bus.announce(Member("codelets", "a/b"))


def test_whoever_publishes_an_image_waits_while_it_is_on_its_way(over_zenoh: OverZenoh) -> None:
    publisher = over_zenoh.join()
    publisher.declare(topics.VIEW)
    began_s = time.monotonic()

    publisher.publish(topics.VIEW, bytes(BATCHED_BYTES + 1), ENVELOPE)

    assert time.monotonic() - began_s >= TRANSIT_S


def test_several_who_are_on_the_bus_may_answer_each_for_itself(over_zenoh: OverZenoh) -> None:
    asker, *answerers = (over_zenoh.join() for _ in range(3))
    for number, answerer in enumerate(answerers):
        own = replace(ENVELOPE, source=f"module-{number}")
        answerer.claim(Incarnation("module", own.source, own.incarnation))
        answerer.serve(*SNAPSHOTS, partial(_always, Answer(own.source.encode(), own)), work)
        meet(asker, answerer)

    answer = asker.query(topics.SNAPSHOT_REQUEST, b"", TIMEOUT_S)

    assert answer.payload in {b"module-0", b"module-1"}
