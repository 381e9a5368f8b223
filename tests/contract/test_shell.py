"""What the shell promises the module inside it and everybody outside, on either bus."""

from __future__ import annotations

import logging
import time
from pathlib import Path

import pytest

from cogmap.bus.codec import Cause, Envelope, decode, encode
from cogmap.bus.interface import Member
from cogmap.errors import MessageError, NoAnswerError
from cogmap.runtime.delivery.publisher import MAX_CAUSES
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.published import PublishedCounts
from schemas import topics
from schemas.base import Message
from schemas.graph import Decay, Snapshot, SnapshotRequest
from schemas.process import Clock, Health, Presence
from schemas.sensing import MotorCommand, Odometry
from schemas.topics import Delivery, Topic
from tests.support.damage import damaged, golden
from tests.support.networks import (
    TIMEOUT_S,
    Network,
    Peer,
    envelope_of,
    meet,
    publish,
    spin_until,
    working,
)

TAKEN_IN = [
    topic
    for topic in topics.ALL
    if topic.delivery is not Delivery.ON_REQUEST and topic is not topics.PRESENCE
]


def odometry(seq: int, source: str = "sim") -> Odometry:
    return Odometry(
        speed_m_s=1.0, turn_rate_rad_s=0.0, dt_s=0.05, seq=seq, source=source, stamp_ns=seq
    )


def command(odometry: Odometry) -> MotorCommand:
    return MotorCommand(left_wheel_rad_s=1.0, right_wheel_rad_s=1.0, stamp_ns=odometry.stamp_ns)


def listener(network: Network, topic: Topic, heard: list[Message]) -> Shell:
    """An open shell around a module that only keeps what it hears on `topic`."""
    shell = Shell(Module("listener").on(topic, heard.append), network.join(), health=False)
    shell.open()
    return shell


@pytest.mark.parametrize("topic", TAKEN_IN, ids=lambda topic: topic.name)
def test_bad_input_is_counted_and_changes_nothing_else(network: Network, topic: Topic) -> None:
    heard: list[Message] = []
    shell = listener(network, topic, heard)
    meet(network.join(), shell.bus)
    whole = decode(topic, golden(topic))
    proper = encode(envelope_of(whole))
    stranger = encode(Envelope("stranger", whole.seq, 1, 0, 0))
    arrivals = [(payload, proper) for payload in damaged(topic).values()]
    arrivals += [
        (golden(topic), attachment) for attachment in (None, b"", b"\xc1garbage", stranger)
    ]

    for number, (payload, attachment) in enumerate(arrivals, 1):
        network.put(topic, payload, attachment)
        spin_until(lambda: shell.intake.rejected[topic.name] == number, shell)  # noqa: B023
    assert heard == []

    network.put(topic, golden(topic), proper)
    spin_until(lambda: bool(heard), shell)
    assert heard == [whole]
    assert dict(shell.intake.rejected) == {topic.name: len(arrivals)}
    assert dict(shell.intake.received) == {topic.name: 1}
    assert not shell.intake.gaps
    assert shell.meter.faults == 0
    shell.close()


def test_bad_input_is_logged_at_most_once_a_second(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    shell = listener(network, topics.ODOMETRY, [])
    meet(network.join(), shell.bus)
    began_s = time.monotonic()

    with caplog.at_level(logging.WARNING, "cogmap"):
        for _ in range(200):
            network.put(topics.ODOMETRY, b"\x80", encode(envelope_of(odometry(0))))
        spin_until(lambda: shell.intake.rejected["odometry"] == 200, shell)

    said = [record.getMessage() for record in caplog.records]
    assert "odometry" in said[0]
    assert "speed_m_s" in said[0]
    assert len(said) <= 1 + time.monotonic() - began_s
    shell.close()


def test_a_message_that_comes_twice_is_received_once(network: Network) -> None:
    heard: list[Message] = []
    shell = listener(network, topics.ODOMETRY, heard)
    publisher = network.join()
    publisher.declare(topics.ODOMETRY)
    meet(publisher, shell.bus)

    publish(publisher, odometry(0), odometry(1), odometry(1), odometry(0), odometry(2))
    spin_until(lambda: len(heard) == 3, shell)

    assert [message.seq for message in heard] == [0, 1, 2]
    assert (shell.intake.received["odometry"], shell.intake.rejected["odometry"]) == (3, 2)
    shell.close()


def test_a_restarted_source_is_received_from_number_0(network: Network) -> None:
    heard: list[Message] = []
    shell = listener(network, topics.ODOMETRY, heard)
    publisher = network.join()
    publisher.declare(topics.ODOMETRY)
    meet(publisher, shell.bus)

    publish(publisher, odometry(0), odometry(1))
    publish(publisher, odometry(0), odometry(1), incarnation=2)
    spin_until(lambda: len(heard) == 4, shell)

    assert not shell.intake.rejected
    assert not shell.intake.gaps
    shell.close()


@pytest.mark.parametrize("restarts", [1, 3])
def test_what_a_publisher_lost_before_its_restart_is_counted(
    network: Network, tmp_path: Path, restarts: int
) -> None:
    heard: list[Message] = []
    shell = listener(network, topics.ODOMETRY, heard)
    lost = 0

    def run(count: int, unheard: int) -> None:
        sim = Module("sim", emits={topics.ODOMETRY})
        counts = PublishedCounts(tmp_path / "sim.published")
        publisher = Shell(sim, network.join(), health=False, counts=counts)
        publisher.open()
        meet(publisher.bus, shell.bus)
        before = len(heard)
        publisher.publish(sim.stamp([odometry(0)] * count))
        spin_until(lambda: len(heard) == before + count, shell)
        for _ in range(unheard):
            counts.add(topics.ODOMETRY)
        publisher.close()

    run(5, 4)
    for _ in range(restarts):
        lost += 4
        run(5, 4)

    assert dict(shell.intake.gaps) == {"odometry": lost}
    assert not shell.intake.rejected
    shell.close()


def test_a_message_of_an_incarnation_that_has_ended_is_ignored(network: Network) -> None:
    heard: list[Message] = []
    shell = listener(network, topics.ODOMETRY, heard)
    publisher = network.join()
    publisher.declare(topics.ODOMETRY)
    meet(publisher, shell.bus)

    publish(publisher, odometry(0), incarnation=1)
    publish(publisher, odometry(0), incarnation=2)
    publish(publisher, odometry(1), incarnation=1)
    publish(publisher, odometry(1), incarnation=2)
    spin_until(lambda: len(heard) == 3, shell)

    assert [message.seq for message in heard] == [0, 0, 1]
    assert shell.intake.rejected["odometry"] == 1
    shell.close()


def test_a_gap_in_the_numbers_of_a_source_is_counted(network: Network) -> None:
    heard: list[Message] = []
    shell = listener(network, topics.ODOMETRY, heard)
    publisher = network.join()
    publisher.declare(topics.ODOMETRY)
    meet(publisher, shell.bus)

    publish(publisher, odometry(0), odometry(4), odometry(0, "other"), odometry(5))
    spin_until(lambda: len(heard) == 4, shell)

    assert dict(shell.intake.gaps) == {"odometry": 3}
    shell.close()


def test_a_loss_that_the_bus_and_the_numbers_show_counts_once(network: Network) -> None:
    heard: list[Message] = []
    shell = listener(network, topics.ODOMETRY, heard)
    publisher = network.join()
    publisher.declare(topics.ODOMETRY)
    meet(publisher, shell.bus)

    publish(publisher, odometry(0))
    spin_until(lambda: len(heard) == 1, shell)
    shell.intake.count_lost("odometry", 2)
    assert dict(shell.intake.gaps) == {"odometry": 2}
    publish(publisher, odometry(3))
    spin_until(lambda: len(heard) == 2, shell)

    assert dict(shell.intake.gaps) == {"odometry": 2}
    shell.close()


@pytest.mark.parametrize(
    "error", [MessageError("image of the wrong shape"), ZeroDivisionError("division by zero")]
)
def test_a_module_whose_handler_raises_continues(network: Network, error: Exception) -> None:
    def think(message: Odometry) -> MotorCommand:
        if message.seq == 1:
            raise error
        return command(message)

    module = Module("action").on(topics.ODOMETRY, think, emits=[topics.MOTOR_COMMAND])
    shell = Shell(module, network.join(), health=False)
    observer = network.join()
    observer.declare(topics.ODOMETRY)
    peer = Peer(observer, topics.MOTOR_COMMAND)
    shell.open()
    meet(observer, shell.bus)

    publish(observer, odometry(0), odometry(1), odometry(2))
    spin_until(lambda: peer.arrived == 2, shell)

    answers = [decode(topics.MOTOR_COMMAND, arrival.payload) for arrival in peer.take(2)]
    assert [(answer.stamp_ns, answer.seq, answer.source) for answer in answers] == [
        (0, 0, "action"),
        (2, 1, "action"),
    ]
    assert shell.intake.rejected["odometry"] == 1
    assert shell.meter.faults == (0 if isinstance(error, MessageError) else 1)
    shell.close()


def test_the_causes_and_the_latency_of_a_message_travel_with_it(network: Network) -> None:
    module = Module("action").on(
        topics.ODOMETRY, lambda m: command(m) if m.seq % 2 else None, emits=[topics.MOTOR_COMMAND]
    )
    shell = Shell(module, network.join(), health=False)
    observer = network.join()
    observer.declare(topics.ODOMETRY)
    peer = Peer(observer, topics.MOTOR_COMMAND)
    shell.open()
    meet(observer, shell.bus)

    publish(observer, *(odometry(seq) for seq in range(4)))
    spin_until(lambda: peer.arrived == 2, shell)

    for arrival, causes in zip(peer.take(2), ([0, 1], [2, 3]), strict=True):
        assert arrival.envelope is not None
        assert arrival.envelope.causes == [("odometry", "sim", seq) for seq in causes]
        ((name, compute_ns, rest_ns),) = arrival.envelope.stages
        assert name == "action"
        assert compute_ns + rest_ns == arrival.envelope.sent_ns - arrival.envelope.born_ns
    shell.close()


def test_health_carries_the_causes_of_a_module_that_publishes_nothing(
    network: Network,
) -> None:
    module = Module("codelets", "codelets-2").on(
        topics.ODOMETRY, lambda odometry: None, emits=[topics.MOTOR_COMMAND]
    )
    shell = Shell(module, network.join())
    observer = network.join()
    observer.declare(topics.ODOMETRY)
    peer = Peer(observer, topics.HEALTH)
    shell.open()
    meet(observer, shell.bus)

    publish(observer, *(odometry(seq) for seq in range(MAX_CAUSES + 1)))
    spin_until(lambda: shell.intake.received["odometry"] == MAX_CAUSES + 1, shell)
    told: list[Cause] = []
    while not told:
        spin_until(lambda: len(peer.inbox) > 0, shell)
        told += [
            cause
            for arrival in peer.take(1)
            if arrival.envelope
            for cause in arrival.envelope.causes
        ]

    assert told == [("odometry", "sim", seq) for seq in range(MAX_CAUSES + 1)]
    shell.close()


def test_health_reports_what_was_received_and_rejected(network: Network) -> None:
    module = Module("action", "action-1").on(topics.ODOMETRY, command, emits=[topics.MOTOR_COMMAND])
    shell = Shell(module, network.join())
    observer = network.join()
    observer.declare(topics.ODOMETRY)
    peer = Peer(observer, topics.HEALTH)
    shell.open()
    meet(observer, shell.bus)

    publish(observer, odometry(0), odometry(0), odometry(2))
    spin_until(lambda: shell.intake.received["odometry"] == 2, shell)
    spin_until(lambda: peer.arrived > 0, shell)

    health = decode(topics.HEALTH, peer.take(1)[0].payload)
    assert isinstance(health, Health)
    assert (health.module, health.instance, health.source, health.ready) == (
        "action",
        "action-1",
        "action-1",
        True,
    )
    assert (health.received, health.rejected, health.gaps) == (
        {"odometry": 2},
        {"odometry": 1},
        {"odometry": 1},
    )
    assert health.emitted == {"motor/command": 2}
    assert health.memory_mb > 1
    shell.close()


def test_a_module_that_waits_for_others_is_not_ready(network: Network) -> None:
    module = Module("sim").on_start(lambda: None, requires={"action": 1})
    shell = Shell(module, network.join())
    observer = network.join()
    peer = Peer(observer, topics.HEALTH)
    shell.open()
    meet(observer, shell.bus)

    spin_until(lambda: peer.arrived > 0, shell)

    health = decode(topics.HEALTH, peer.take(1)[0].payload)
    assert isinstance(health, Health)
    assert health.ready is False
    assert shell.missing == {"action": 1}
    shell.close()


def test_a_module_that_has_started_stays_ready_when_another_leaves(network: Network) -> None:
    started: list[bool] = []
    module = Module("sim").on_start(lambda: started.append(True), requires={"recorder": 1})
    shell = Shell(module, network.join())
    peer = Peer(network.join(), topics.HEALTH)
    shell.open()
    recorder = network.join()
    recorder.announce(Member("recorder", "recorder"))
    spin_until(lambda: bool(started), shell)

    recorder.close()
    spin_until(lambda: shell.missing == {"recorder": 1}, shell)
    before = peer.arrived
    spin_until(lambda: peer.arrived > before, shell)

    health = decode(topics.HEALTH, peer.take(1)[0].payload)
    assert isinstance(health, Health)
    assert health.ready
    shell.close()


def test_those_that_a_start_requires_miss_nothing(network: Network) -> None:
    heard: dict[str, list[int]] = {"one": [], "two": []}
    first = [odometry(seq) for seq in range(20)]
    sim = Module("sim").on_start(lambda: first, requires={"listener": 2}, emits=[topics.ODOMETRY])
    starting = Shell(sim, network.join(), health=False)
    starting.open()
    waiting = [
        Shell(
            Module("listener", name).on(
                topics.ODOMETRY, lambda m, name=name: heard[name].append(m.seq)
            ),
            network.join(),
            health=False,
        )
        for name in heard
    ]

    waiting[0].open()
    spin_until(lambda: starting.missing == {"listener": 1}, starting)
    assert heard == {"one": [], "two": []}
    waiting[1].open()
    spin_until(lambda: all(len(seqs) == 20 for seqs in heard.values()), starting, *waiting)

    assert heard == {name: list(range(20)) for name in heard}
    for shell in (starting, *waiting):
        shell.close()


def test_a_start_happens_once_though_a_required_module_restarts(network: Network) -> None:
    started: list[int] = []
    shell = Shell(
        Module("sim").on_start(lambda: started.append(1), requires={"action": 1}),
        network.join(),
        health=False,
    )
    shell.open()
    for _ in range(2):
        action = Shell(Module("action"), network.join(), health=False)
        action.open()
        spin_until(lambda: not shell.missing, shell)
        action.close()
        spin_until(lambda: bool(shell.missing), shell)

    assert started == [1]
    shell.close()


def test_a_module_that_observes_presence_learns_who_comes_and_goes(network: Network) -> None:
    told: list[Presence] = []
    module = Module("workspace").on(topics.PRESENCE, told.append, emits=[topics.PRESENCE])
    shell = Shell(module, network.join(), health=False)
    worker = network.join()
    shell.open()

    worker.announce(Member("codelets", "codelets-1"))
    spin_until(lambda: any(presence.module == "codelets" for presence in told), shell)
    worker.close()
    spin_until(lambda: any(not presence.alive for presence in told), shell)

    assert [(p.instance, p.alive) for p in told if p.module == "codelets"] == [
        ("codelets-1", True),
        ("codelets-1", False),
    ]
    shell.close()


def test_a_query_without_sense_is_refused_and_counted(network: Network) -> None:
    empty = Snapshot(version=0, cycle=0, decay=Decay(), nodes=[], links=[], tiles=[])
    module = Module("workspace").serve(
        topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, lambda request: empty
    )
    shell = Shell(module, network.join(), health=False)
    asker = network.join()
    with working(shell):
        meet(asker, shell.bus)
        with pytest.raises(NoAnswerError, match="stamp_ns"):
            asker.query(
                topics.SNAPSHOT_REQUEST,
                encode(SnapshotRequest()).replace(b"\x00", b"\xff", 1),
                TIMEOUT_S,
            )
        answer = asker.query(topics.SNAPSHOT_REQUEST, encode(SnapshotRequest()), TIMEOUT_S)

    assert decode(topics.SNAPSHOT, answer.payload) == empty
    assert shell.intake.rejected == {"workspace/snapshot_request": 1}


def test_a_superseded_clock_is_never_handled(network: Network) -> None:
    heard: list[Message] = []
    shell = listener(network, topics.CLOCK, heard)
    publisher = network.join()
    publisher.declare(topics.CLOCK)
    meet(publisher, shell.bus)
    peer = Peer(network.join(), topics.CLOCK)
    meet(publisher, peer.bus)

    publish(publisher, *(Clock(seq=seq, source="sim") for seq in range(100)))
    peer.wait_for(100)
    spin_until(lambda: bool(heard) and heard[-1].seq == 99, shell)

    assert shell.inbox.superseded["clock"] + len(heard) == 100
    shell.close()
