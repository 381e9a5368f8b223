"""Replaying a small stateful module from a log: the same bytes, or the first difference."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.errors import LogError
from cogmap.recording.recorder import Recorder
from cogmap.recording.replaying.outcome import Report
from cogmap.recording.replaying.replay import Build, replay_into
from cogmap.recording.selection import to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.writer import LogWriter
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.journal import Journal
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.process import Clock
from schemas.sensing import MotorCommand, Odometry, RangeScan

Sections = dict[str, dict[str, Any]]


class Mixer:
    """What it says depends on everything it took in, and on the order."""

    def __init__(self, start: float, every: int) -> None:
        self._state = start
        self._taken = 0
        self._every = every

    def take(self, message: Message) -> list[Message]:
        self._state = (self._state * 0.7 + message.seq + len(type(message).__name__)) % 1000
        self._taken += 1
        if self._taken % self._every:
            return []
        range_m = Array.of(np.full((4, 2), self._state, np.float32))
        return [
            RangeScan(stamp_ns=message.stamp_ns, frame=0, bearing_rad=range_m, range_m=range_m),
            MotorCommand(
                stamp_ns=message.stamp_ns, left_wheel_rad_s=self._state, right_wheel_rad_s=0.0
            ),
        ]

    def begin(self) -> MotorCommand:
        return MotorCommand(left_wheel_rad_s=-1.0, right_wheel_rad_s=self._state % 1)

    def tick(self, now_ns: int) -> MotorCommand:
        self._state = (self._state + now_ns % 97) % 1000
        return MotorCommand(left_wheel_rad_s=self._state, right_wheel_rad_s=1.0)

    def restore(self, past: Iterable[Message]) -> None:
        for message in past:
            if isinstance(message, MotorCommand):
                self._state = (self._state + message.left_wheel_rad_s) % 1000

    def compact(self) -> MotorCommand:
        return MotorCommand(left_wheel_rad_s=self._state, right_wheel_rad_s=0.0)


def build(name: str, sections: Sections, instance: str) -> Module:
    mixer = Mixer(sections.get(name, {}).get("start", 1.0), sections.get(name, {}).get("every", 3))
    says = (topics.SCAN, topics.MOTOR_COMMAND)
    module = (
        Module(name, instance).on(topics.ODOMETRY, mixer.take, says).on(topics.CLOCK, mixer.take)
    )
    module.on_start(mixer.begin, {"sim": 1}).journaling(
        topics.MOTOR_COMMAND, mixer.restore, mixer.compact
    )
    return module.every(10**15, mixer.tick) if sections.get(name, {}).get("timer") else module


class Session:
    """Shells around mixers on the in-memory bus, a recorder, and a bus to feed them on."""

    def __init__(self, path: Path, sections: Sections | None = None) -> None:
        self.network = MemoryNetwork()
        self.sections = sections or {}
        about = {"config": json.dumps(self.sections)}
        self.recorder = Recorder(MemoryBus(self.network), path, to_record(exclude="health"), about)
        self.recorder.open()
        self.bus = MemoryBus(self.network)
        self.bus.announce(Member("sim", "sim"))
        self.shells: dict[str, Shell] = {}
        self.now_ns = time.time_ns() + 10**9

    def enter(self, instance: str = "mixer", journal: Journal | None = None) -> Shell:
        shell = Shell(
            build("mixer", self.sections, instance), MemoryBus(self.network), journal, health=False
        )
        self.shells[instance] = shell
        shell.open()
        return shell

    def say(self, message: Message, sent_ns: int, incarnation: int = 1) -> None:
        message = msgspec.structs.replace(message, source="sim")
        envelope = Envelope("sim", message.seq, incarnation, self.now_ns + sent_ns, 0)
        self.bus.publish(topics.of(message), encode(message), envelope)

    def settle(self) -> None:
        for shell in self.shells.values():
            while shell.spin_once():
                pass

    def end(self) -> None:
        self.settle()
        self.recorder.close()


def odometry(seq: int) -> Odometry:
    return Odometry(stamp_ns=seq * 10**9, seq=seq, speed_m_s=1.0, turn_rate_rad_s=0.0, dt_s=0.05)


def clock(seq: int) -> Message:
    return Clock(stamp_ns=seq * 10**9, seq=seq)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "log.mcap"


def record(
    path: Path, sections: Sections | None = None, instances: Iterable[str] = ("mixer",)
) -> None:
    """Thirty odometry messages, the clock in between; log time runs backwards within each three."""
    session = Session(path, sections)
    for instance in instances:
        session.enter(instance)
    for seq in range(30):
        session.say(odometry(seq), 1000 * (seq // 3) + 300 - seq % 3)
        session.say(clock(seq), 1000 * (seq // 3) + 200 - seq % 3)
        session.settle()
    session.end()


def replay(path: Path, build: Build = build, **options: Any) -> Report:
    return replay_into(path, ["mixer"], build, **options)


def test_a_replay_feeds_inputs_in_the_order_of_causes_not_of_the_log(
    path: Path,
) -> None:
    record(path)
    times = [r.log_time_ns for r in LogReader(path).records({topics.ODOMETRY})]
    assert times == sorted(times)
    report = replay(path)
    (outcome,) = report.outcomes
    assert report.same
    assert (outcome.fed, outcome.same, outcome.different, outcome.notes) == (60, 41, 0, [])
    assert report.speed > 0


def test_every_instance_is_replayed_by_itself(path: Path) -> None:
    record(path, instances=("mixer-1", "mixer-2"))
    report = replay(path)
    assert [outcome.instance for outcome in report.outcomes] == ["mixer-1", "mixer-2"]
    assert report.same
    assert all(outcome.same == 41 for outcome in report.outcomes)


def test_processes_give_the_same_report_as_one(path: Path) -> None:
    record(path, instances=("mixer-1", "mixer-2"))
    one = replay(path, processes=1)
    two = replay(path, processes=2)
    assert [(o.instance, o.same) for o in one.outcomes] == [
        (o.instance, o.same) for o in two.outcomes
    ]


def test_the_recorded_configuration_is_used_unless_it_is_overridden(path: Path) -> None:
    record(path, {"mixer": {"start": 5.0}})
    assert replay(path).same
    assert not replay(path, overrides={"mixer": {"start": 6.0}}).same


def test_outputs_of_a_timer_are_replayed_with_its_time(path: Path) -> None:
    session = Session(path, {"mixer": {"timer": True}})
    shell = session.enter()
    session.say(odometry(0), 1)
    session.settle()
    timer = shell.module.timers[0]
    for seq in range(1, 8):
        shell._timer(timer.handler)(seq * 1_234_567)
        session.say(odometry(seq), seq)
        session.settle()
    session.end()
    report = replay(path)
    assert report.same
    assert report.outcomes[0].same > 7


def test_a_restarted_module_is_replayed_from_what_its_journal_held(
    path: Path, tmp_path: Path
) -> None:
    session = Session(path)
    journal = tmp_path / "mixer.journal"
    for life in range(3):
        shell = session.enter("mixer", Journal(journal))
        for seq in range(7 * life, 7 * life + 7):
            session.say(odometry(seq), seq)
        session.settle()
        shell.close()
    session.end()
    report = replay(path)
    assert [outcome.incarnation for outcome in report.outcomes] == [0, 1, 2]
    assert report.same, report.first


def test_inputs_from_a_restarted_source_are_told_apart_by_its_incarnation(path: Path) -> None:
    session = Session(path)
    session.enter()
    for incarnation in (1, 2):
        for seq in range(6):
            plain = odometry(seq)
            message = replace(plain, stamp_ns=plain.stamp_ns + incarnation)
            session.say(message, 100 * incarnation + seq, incarnation)
        session.settle()
    session.end()
    report = replay(path)
    assert report.same, report.first


def _shifted(name: str, sections: Sections, instance: str) -> Module:
    module = build(name, sections, instance)
    said = module.handlers[topics.ODOMETRY]
    count = iter(range(1000))

    def handler(message: Message) -> Iterable[Message]:
        messages = []
        for scan in said(message):
            if isinstance(scan, RangeScan) and next(count) >= 2:
                values = scan.range_m.numpy().copy()
                values[1, 1] += 1
                scan = msgspec.structs.replace(scan, range_m=Array.of(values))  # noqa: PLW2901
            messages.append(scan)
        return messages

    module.handlers[topics.ODOMETRY] = handler
    return module


def test_the_first_difference_names_message_field_and_both_values(
    path: Path,
) -> None:
    record(path)
    report = replay(path, _shifted)
    assert not report.same
    expected = next(
        message
        for r in LogReader(path).records({topics.SCAN})
        if isinstance(message := LogReader(path).message(r), RangeScan) and message.seq == 4
    )
    value = expected.range_m.numpy()[1, 1].item()
    assert report.first == (
        f"sensory/scan number 4 of mixer (stamp {expected.stamp_ns / 1e9:.3f} s): "
        f"range_m.1.1 is {value!r} in the log, "
        f"{np.float32(value + 1).item()!r} in the replay (1 of 8 values differ)"
    )


def _silent(name: str, sections: Sections, instance: str) -> Module:
    return build(name, {name: {"every": 1000}}, instance)


def test_an_output_that_is_no_longer_published_is_named(path: Path) -> None:
    record(path)
    report = replay(path, _silent)
    assert not report.same
    assert "sensory/scan number 0 of mixer" in report.first
    assert report.first.endswith("is in the log and not published in the replay")


def _refusing(name: str, sections: Sections, instance: str) -> Module:
    module = build(name, sections, instance)
    module.handlers[topics.CLOCK] = lambda clock: 1 / 0
    return module


def test_an_input_that_is_refused_now_is_named(path: Path) -> None:
    record(path)
    assert (
        replay(path, _refusing).first
        == "clock: mixer refuses what it received: ZeroDivisionError: division by zero"
    )


def test_inputs_that_the_log_lacks_are_counted_by_topic(path: Path, tmp_path: Path) -> None:
    record(path)
    thinner = tmp_path / "thinner.mcap"
    reader = LogReader(path)
    writer = LogWriter(thinner, to_record(), {"config": "{}"})
    for r in reader.records():
        if r.topic is not topics.CLOCK:
            writer.write(r.topic, reader.payload(r), r.envelope, r.log_time_ns)
    writer.close()
    report = replay(thinner)
    assert report.outcomes[0].missing_inputs == {"clock": 30}
    assert report.outcomes[0].notes == ["inputs that the log lacks: 30 of clock"]
    assert not report.same


def without_envelopes(path: Path, folder: Path) -> Path:
    """A copy of the log, as one that another program has recorded."""
    bare = folder / "bare.mcap"
    reader = LogReader(path)
    writer = LogWriter(bare, to_record(), {"config": "{}"})
    for record in reader.records():
        writer.write(record.topic, reader.payload(record), None, record.log_time_ns)

    writer.close()
    return bare


def test_without_envelopes_inputs_are_fed_in_the_order_of_the_log(
    path: Path, tmp_path: Path
) -> None:
    session = Session(path)
    session.enter()
    for seq in range(20):
        session.say(clock(seq), 10 * seq)
        session.say(odometry(seq), 10 * seq)
        session.settle()
    session.end()
    report = replay(without_envelopes(path, tmp_path))
    assert report.same, report.first
    assert report.outcomes[0].same == 27
    assert report.outcomes[0].notes == [
        "the log has no envelopes: inputs were fed in the order of the log"
    ]


def test_without_envelopes_refused_inputs_are_counted_in_the_notes(
    path: Path, tmp_path: Path
) -> None:
    record(path)
    bare = without_envelopes(path, tmp_path)

    (outcome,) = replay(bare, _refusing).outcomes

    refusal = "clock: mixer refuses what it received: ZeroDivisionError: division by zero"
    assert f"30 inputs refused, the first: {refusal}" in outcome.notes


def test_a_module_that_published_nothing_is_named_with_those_that_did(path: Path) -> None:
    record(path)
    with pytest.raises(LogError, match="nothing that module epam published: there are mixer, sim"):
        replay_into(path, ["epam"], build)
