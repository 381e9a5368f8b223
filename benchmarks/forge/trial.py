"""Tells the lies of one case to a driving system, and watches it until it is itself again."""

from __future__ import annotations

import re
import subprocess
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType

from msgspec.structs import replace

from benchmarks.campaign.forger import Forger
from benchmarks.campaign.listener import Listener
from benchmarks.campaign.replica import FollowedGraph
from benchmarks.campaign.running import PERCEPT_LEVEL, RunningSystem
from benchmarks.forge.cases import TOLD_AS_ONESELF, Case, Kind, Mode
from benchmarks.forge.lies import STRANGER, TURN_RAD, lie
from benchmarks.forge.outcome import (
    BACKWARDS_M_S,
    STOPPED_S,
    Outcome,
    flowing_after_s,
    longest_stand_s,
    slowest_m_s,
    usual_gap_s,
)
from cogmap.bus.codec import decode
from cogmap.bus.discovery import Role, discover
from cogmap.bus.interface import Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.doctor import system
from cogmap.cli.doctor.command import OBSERVE_S, observe
from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.errors import CogmapError
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import MotorProgram
from cogmap.schemas.examples import example
from cogmap.schemas.topics import Topic
from cogmap.services import registry

LIE_S = 1.0
FLOOD_S = 2.0
FLOOD_HZ = 5000
BURST = 50
PRESENT_S = 4.0
"""How long a ghost's token is there, and a second instance once it has started."""

LIE_HZ = 20
WATCH_S = 2.5
PATIENCE_S = 8.0
START_S = 90.0
MOVING_S = 20.0
TICK_S = 0.02
HEALTH_S = 1.2
"""A report of health may come so long after what it counts."""

LAPS = "40"
FOLLOWER = "follower"
Sentences = list[str]


class Driving:
    """A system that drives, and those who listen to it, follow its graph and lie to it."""

    def __init__(self, folder: Path, mode: Mode, seed: int, limit_s: float) -> None:
        options = [*PERCEPT_LEVEL, "--seed", str(seed), "--laps", LAPS]
        if mode is Mode.LOCKSTEP:
            options.append("--lockstep")
        self.mode = mode
        self.told: Counter[Topic] = Counter()
        self.system = RunningSystem(folder, limit_s, options)
        self._buses: list[ZenohBus] = []
        try:
            self._join()
        except BaseException:
            self.close()
            raise

    def _join(self) -> None:
        running = self.system
        self.forger = Forger(running.endpoint, running.agent, START_S)
        self.listener = Listener(self._bus("cli-listener"), self.forger.has_put)
        self.replica: FollowedGraph | None = None
        self.doctors = ThreadPoolExecutor(1)
        self.doctor_bus = self._bus("cli-doctor")
        self._said_by_doctor: set[str] = set()
        if not self.await_motion(START_S):
            text = running.output.read_text(errors="replace")[-500:]
            raise CogmapError(f"the drive in {running.folder} did not begin: {text}")
        self.replica = FollowedGraph(running.endpoint, running.agent)

    def _bus(self, name: str) -> ZenohBus:
        bus = ZenohBus(self.system.endpoint, self.system.agent)
        self._buses.append(bus)
        bus.identify(Member("cli", name))
        return bus

    def await_motion(self, timeout_s: float) -> bool:
        """Wait until wheels turn. Returns whether they do."""
        began_s = time.monotonic()
        while time.monotonic() < began_s + timeout_s and not self.system.has_ended:
            self.listener.pump(0.2)
            moves = [each for each in self.listener.commands if each.moves]
            newest = moves[-20:]
            if len(newest) >= 10 and newest[-1].time_s > time.monotonic() - 2:
                return True
        return False

    def examine(self) -> Future[Sentences]:
        """Let a doctor look at the system meanwhile. The result is what it has not said before."""
        return self.doctors.submit(self._examined)

    def _examined(self) -> Sentences:
        bus = self.doctor_bus
        observed = observe(bus, OBSERVE_S)
        found = discover(bus.session, self.system.agent)
        findings = {
            str(finding) for finding in system.examine(registry.taking_part(), observed, found)
        }
        new = findings - self._said_by_doctor
        self._said_by_doctor |= findings
        return sorted(f"doctor: {finding}" for finding in new)

    def publishers(self, topic: Topic) -> list[str]:
        """Return the instances that may publish `topic`."""
        found = discover(self.forger.session, self.system.agent)
        doing = found.doing(Role.PUBLISHES, topic)
        return [process.member.instance for process in doing if process.member is not None]

    def close(self) -> None:
        """End it."""
        self.system.end()
        if getattr(self, "replica", None) is not None:
            assert self.replica is not None
            self.replica.close()
        for bus in self._buses:
            bus.close()
        if hasattr(self, "doctors"):
            self.doctors.shutdown()
        if hasattr(self, "forger"):
            self.forger.close()

    def __enter__(self) -> Driving:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class Trial:
    """One case, told to a driving system."""

    def __init__(self, driving: Driving, case: Case) -> None:
        self._driving = driving
        self._case = case
        self._listener = driving.listener
        self._outcome = Outcome(case)
        self._words = [case.subject, STRANGER]
        if case.kind is Kind.GHOST:
            self._words = [f"{case.subject}-ghost"]

    def run(self) -> Outcome:
        """Tell the lies, watch, and return what became of it."""
        driving, listener, outcome = self._driving, self._listener, self._outcome
        listener.pump(0.0)
        listener.forget()
        self._texts = driving.system.sizes()
        self._notes = self._all_notes()
        self._counts = self._all_counts()
        gap_s = usual_gap_s(listener.commands)
        doctor = driving.examine()
        began_s = time.monotonic()

        self._tell()
        last_lie_s = time.monotonic()
        self._watch(last_lie_s, gap_s, doctor)
        now_s = time.monotonic()

        outcome.ended = driving.system.has_ended
        outcome.stood_s = longest_stand_s(listener.commands, last_lie_s, now_s)
        if not self._moves_since(max(last_lie_s, now_s - STOPPED_S)):
            outcome.recovered_s = None
        outcome.is_steered = self._is_steered(began_s)
        if not outcome.has_stopped:
            outcome.is_forked = self._is_forked(last_lie_s)
        outcome.named_by += self._named_by(doctor)
        return outcome

    def _watch(self, last_lie_s: float, gap_s: float, doctor: Future[Sentences]) -> None:
        """Watch until it is itself again, or for PATIENCE_S, and until the doctor is done."""
        listener = self._listener
        while True:
            listener.pump(TICK_S)
            now_s = time.monotonic()
            if self._driving.system.has_ended:
                return

            recovered_s = flowing_after_s(listener.commands, last_lie_s, now_s, gap_s)
            deaf_s = self._deaf_s(last_lie_s, now_s)
            if recovered_s is not None and deaf_s is not None:
                recovered_s = max(recovered_s, deaf_s)
            else:
                recovered_s = None
            self._outcome.recovered_s = recovered_s

            watched_s = now_s - last_lie_s
            moves = self._moves_since(last_lie_s)
            is_itself = recovered_s is not None and (moves or watched_s > STOPPED_S)
            if watched_s > PATIENCE_S or (is_itself and watched_s > WATCH_S and doctor.done()):
                return

    def _moves_since(self, time_s: float) -> bool:
        """Return whether a command has turned wheels since."""
        commands = self._listener.commands
        return any(each.moves and each.time_s > time_s for each in commands)

    def _deaf_s(self, last_lie_s: float, now_s: float) -> float | None:
        """Return how long after the last lie messages of its topic were still rejected; None if
        they are.
        """
        last_s = last_lie_s
        for reports in self._listener.health.values():
            before = None
            for time_s, health in reports:
                count = health.rejected.get(self._case.subject, 0)
                if before is not None and count > before and time_s > last_lie_s + HEALTH_S:
                    last_s = max(last_s, time_s)
                before = count
        if last_s > last_lie_s and last_s > now_s - 1.5:
            return None
        return last_s - last_lie_s

    def _is_steered(self, began_s: float) -> bool:
        """Return whether the robot drove backwards as a lie commanded, or executes its turn."""
        places = [place for place in self._listener.places if place.time_s >= began_s]
        is_backwards = slowest_m_s(places) < BACKWARDS_M_S
        programs = [decode(topics.MOTOR_PROGRAM, payload) for payload in self._listener.programs]
        turns = [
            program
            for program in programs
            if isinstance(program, MotorProgram) and program.parameters.get("turn_rad") == TURN_RAD
        ]
        return is_backwards or bool(turns)

    def _is_forked(self, last_lie_s: float) -> bool:
        """Return whether a graph that follows differs from the workspace's, and still does
        STOPPED_S after the last lie.
        """
        replica = self._driving.replica
        assert replica is not None
        while True:
            self._listener.pump(0.0)
            is_same = replica.is_same()
            if is_same:
                return False
            if time.monotonic() > last_lie_s + STOPPED_S:
                self._outcome.remark = "no answer" if is_same is None else "differs"
                return True
            self._listener.pump(0.5)

    # ---- who names it

    def _named_by(self, doctor: Future[Sentences]) -> Sentences:
        until_s = time.monotonic() + HEALTH_S
        while time.monotonic() < until_s:
            self._listener.pump(TICK_S)

        lines = self._driving.system.lines_since(self._texts)
        found = [line for line in lines if self._is_about(line)]
        for name, count in self._all_counts().items():
            if count > self._counts.get(name, 0):
                found.append(f"health: {name} {count}")
        found += [f"health: {note}" for note in self._all_notes() - self._notes]
        found += [sentence for sentence in doctor.result() if self._is_about(sentence)]
        return found

    def _is_about(self, sentence: str) -> bool:
        return any(word in sentence for word in self._words)

    def _all_notes(self) -> set[str]:
        """Return all that is reported in words, without its numbers."""
        notes = set()
        for instance, reports in self._listener.health.items():
            if reports:
                notes |= {f"{instance}: {_plain(note)}" for note in reports[-1][1].notes}
        replica = self._driving.replica
        if replica is not None:
            notes |= {f"{FOLLOWER}: {_plain(note)}" for note in replica.notes}
        return notes

    def _all_counts(self) -> dict[str, int]:
        """Return what was rejected of the topic and what was lost, by instance."""
        counts = {}
        for instance, reports in self._listener.health.items():
            if reports:
                health = reports[-1][1]
                name = self._case.subject
                counts[f"{instance} rejected"] = health.rejected.get(name, 0)
                counts[f"{instance} lost"] = health.gaps.get(name, 0)
        return counts

    # ---- the lies

    def _tell(self) -> None:
        match self._case.kind:
            case Kind.GHOST:
                self._be_a_ghost()
            case Kind.SECOND_INSTANCE:
                self._be_second()
            case Kind.FLOOD:
                self._flood()
            case _:
                self._lie()

    def _true(self, topic: Topic) -> tuple[Message, int, int]:
        """Return the newest message of a topic, the incarnation of its source and the number of its
        next; an example where there was none.
        """
        received = self._listener.newest.get(topic)
        if received is not None:
            message = decode(topic, received.payload)
            return message, received.envelope.incarnation, message.seq + 1

        sources = self._driving.publishers(topic)
        source = sources[0] if sources else "nobody"
        incarnation = self._listener.incarnations.get(source, time.time_ns())
        now_ns = self._listener.places[-1].pose.stamp_ns
        message = replace(example(topic), source=source, stamp_ns=now_ns)
        return message, incarnation, 0

    def _lie(self) -> None:
        """Lie after each true message of the topic, LIE_HZ at most; without any, as often."""
        topic = self._case.topic
        assert topic is not None
        waits_for = topics.TRUE_POSE if topic is topics.MOTOR_COMMAND else topic
        own = time.time_ns()
        next_s = 0.0
        told = 0

        def tell() -> None:
            nonlocal next_s, told
            if time.monotonic() >= next_s:
                next_s = time.monotonic() + 1 / LIE_HZ
                self._tell_once(topic, own, told)
                told += 1

        def on_topic(received: Topic) -> None:
            if received is waits_for:
                tell()

        began_s = time.monotonic()
        self._listener.on_topic = on_topic
        while (passed_s := time.monotonic() - began_s) < LIE_S:
            self._listener.pump(TICK_S)
            if passed_s > LIE_S / 2 and (not told or topic not in self._listener.newest):
                tell()
        self._listener.on_topic = _nothing
        self._outcome.lies = told

    def _tell_once(self, topic: Topic, own: int, told: int) -> None:
        """Put one lie. It has the next number of who publishes, or a number of the liar's own."""
        driving, kind = self._driving, self._case.kind
        true, incarnation, number = self._true(topic)
        true = self._in_time(topic, true)
        if kind in TOLD_AS_ONESELF:
            incarnation = own
        is_numbered = kind in (*TOLD_AS_ONESELF, Kind.FAR_NUMBER)
        if topic not in self._listener.newest and not is_numbered:
            number = driving.told[topic]
            driving.told[topic] += 1
        message = lie(kind, true, number, told if is_numbered else 0)
        driving.forger.put(topic, message, incarnation)

    def _in_time(self, topic: Topic, true: Message) -> Message:
        """Let a command answer the newest view: the body obeys no other."""
        if topic is not topics.MOTOR_COMMAND or not self._listener.places:
            return true
        return replace(true, stamp_ns=self._listener.places[-1].pose.stamp_ns)

    def _flood(self) -> None:
        topic = self._case.topic
        assert topic is not None
        true, _, _ = self._true(topic)
        own = time.time_ns()
        began_s = time.monotonic()
        told = 0
        while (passed_s := time.monotonic() - began_s) < FLOOD_S:
            if told > FLOOD_HZ * passed_s:
                self._listener.pump(0.001)
                continue
            for _ in range(BURST):
                self._driving.forger.put(topic, lie(Kind.FLOOD, true, 0, told), own)
                told += 1
        self._outcome.lies = told

    def _be_a_ghost(self) -> None:
        module = self._case.subject
        self._driving.forger.announce(Member(module, f"{module}-ghost"))
        self._pump_until(lambda: False, PRESENT_S)
        self._driving.forger.withdraw()
        self._outcome.lies = 1

    def _be_second(self) -> None:
        """Start another process of a module's instance, as by mistake, and end it."""
        running = self._driving.system
        module = self._case.subject
        instance = f"{module}-1" if module == "codelets" else module
        command = cogmap_command(
            "module",
            module,
            "--instance",
            instance,
            "--connect",
            running.endpoint,
            "--agent",
            running.agent,
            "--config",
            str(running.folder / "config.toml"),
        )
        log = running.folder / f"second-{module}.log"
        with log.open("ab") as output:
            second = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=environment()
            )
        try:
            self._pump_until(lambda: second.poll() is not None or _is_ready(log), 20.0)
            self._pump_until(lambda: second.poll() is not None, PRESENT_S)
            if second.poll() is not None:
                self._outcome.remark = f"it ended with {second.returncode}"
            self._outcome.lies = 1
        finally:
            second.terminate()
            try:
                second.wait(10.0)
            except subprocess.TimeoutExpired:
                second.kill()
                second.wait()
        text = log.read_text(errors="replace")
        log.unlink()
        for line in text.splitlines():
            if "is ready" not in line:
                self._outcome.named_by.append(f"second {module}: {line}")

    def _pump_until(self, condition: Callable[[], bool], timeout_s: float) -> None:
        until_s = time.monotonic() + timeout_s
        while time.monotonic() < until_s and not condition():
            self._listener.pump(TICK_S)


def _is_ready(log: Path) -> bool:
    return "is ready" in log.read_text(errors="replace")


def _nothing(topic: Topic) -> None:
    """Do nothing."""


def _plain(note: str) -> str:
    return re.sub(r"\d+", "#", note)
