"""What a running system does, as one sees it who listens on its bus to everything."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import Empty, Queue

from cogmap.bus.codec import Envelope, decode
from cogmap.bus.interface import Arrival, Bus
from cogmap.errors import MessageError
from cogmap.schemas import topics
from cogmap.schemas.process import Health
from cogmap.schemas.sensing import MotorCommand, TruePose
from cogmap.schemas.topics import Delivery, Topic

CARRIED: tuple[Topic, ...] = tuple(
    topic for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST
)
"""The topics whose messages travel by themselves, not as answers."""

MOVING_RAD_S = 0.05


@dataclass(frozen=True, slots=True)
class Received:
    """The bytes of a genuine message, and its envelope."""

    payload: bytes
    envelope: Envelope


@dataclass(frozen=True, slots=True)
class Command:
    """A motor command that answers a view later than those before it: when it was sent, monotonic,
    whether it turns a wheel, and the reason where it halts them.
    """

    time_s: float
    moves: bool
    halted_by: str = ""


@dataclass(frozen=True, slots=True)
class Place:
    """A true pose: when it was sent, monotonic, and when it was true."""

    time_s: float
    pose: TruePose


class Listener:
    """Keeps what genuine modules publish: the newest message of every topic, and all commands,
    poses and reports of health. `is_forged` tells what an attacker has put; of the sources in
    `trusted` only that incarnation is genuine.

    Times are those of sending: the process that puts a flood receives it too, and is late itself.
    `pump` it from one thread.
    """

    def __init__(self, bus: Bus, is_forged: Callable[[Envelope], bool]) -> None:
        self.newest: dict[Topic, Received] = {}
        self.incarnations: dict[str, int] = {}
        self.commands: list[Command] = []
        self.places: list[Place] = []
        self.health: defaultdict[str, list[tuple[float, Health]]] = defaultdict(list)
        self.programs: list[bytes] = []
        self.on_topic: Callable[[Topic], None] = lambda topic: None
        self.trusted: dict[str, int] = {}
        self._is_forged = is_forged
        self._arrivals: Queue[Arrival] = Queue()
        self._monotonic_ahead_s = time.monotonic() - time.time()
        self._answered_ns = -1
        for topic in CARRIED:
            bus.subscribe(topic, self._arrivals.put, lambda name, number: None)

    def pump(self, timeout_s: float) -> None:
        """Take account of all that has come, waiting up to `timeout_s` for the first."""
        until_s = time.monotonic() + timeout_s
        while True:
            left_s = until_s - time.monotonic()
            try:
                arrival = self._arrivals.get(timeout=max(0.0, left_s))
            except Empty:
                return
            self._take(arrival)

    def forget(self) -> None:
        """Forget all but the newest of what has come."""
        del self.commands[:-20]
        del self.places[:-20]
        self.programs.clear()
        for reports in self.health.values():
            del reports[:-1]

    def _take(self, arrival: Arrival) -> None:
        envelope = arrival.envelope
        if envelope is None or self._is_forged(envelope):
            return
        trusted = self.trusted.get(envelope.source, envelope.incarnation)
        if envelope.incarnation != trusted:
            return

        payload = bytes(arrival.payload)
        topic = arrival.topic
        time_s = envelope.sent_ns * 1e-9 + self._monotonic_ahead_s
        self.newest[topic] = Received(payload, envelope)
        self.incarnations[envelope.source] = envelope.incarnation
        try:
            self._note(topic, payload, time_s)
        except MessageError:
            return
        self.on_topic(topic)

    def _note(self, topic: Topic, payload: bytes, time_s: float) -> None:
        if topic is topics.MOTOR_PROGRAM:
            self.programs.append(payload)
        if topic not in (topics.MOTOR_COMMAND, topics.TRUE_POSE, topics.HEALTH):
            return

        match decode(topic, payload):
            case MotorCommand() as command:
                self._note_command(command, time_s)
            case TruePose() as pose:
                self.places.append(Place(time_s, pose))
            case Health() as health:
                self.health[health.instance].append((time_s, health))

    def _note_command(self, command: MotorCommand, time_s: float) -> None:
        """Keep a command that answers a later view than those before. One that answers a time that
        has not come moves nothing.
        """
        now_ns = self.places[-1].pose.stamp_ns if self.places else 0
        is_later = self._answered_ns < command.stamp_ns <= now_ns + MAX_AHEAD_NS
        if not is_later:
            return

        self._answered_ns = command.stamp_ns
        fastest_rad_s = max(abs(command.left_wheel_rad_s), abs(command.right_wheel_rad_s))
        self.commands.append(Command(time_s, fastest_rad_s > MOVING_RAD_S, command.halted_by.value))


MAX_AHEAD_NS = 1_000_000_000
"""A true pose gives way to other messages: it may come after the command of its time."""


def times_s(commands: Sequence[Command]) -> list[float]:
    """Return when each was sent."""
    return [command.time_s for command in commands]
