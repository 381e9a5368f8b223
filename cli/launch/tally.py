"""Counts the messages of a run: its path, its graph, cycle times, the health of its processes.
Pure.
"""

from __future__ import annotations

from array import array
from collections import Counter, deque
from collections.abc import Mapping

import msgspec

from cogmap.bus.codec import Envelope
from cogmap.bus.interface import Arrival
from cogmap.cli.launch.individuals.percepts import PerceptTally
from cogmap.cli.launch.observer import OBSERVED, Observer
from cogmap.errors import MessageError
from cogmap.graph.replica import Replica
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.graph import Delta, DropNode
from cogmap.schemas.nodes import Object
from cogmap.schemas.process import Health, Paused
from cogmap.schemas.sensing import Energy, MotorCommand, SpeedLimit
from cogmap.schemas.topics import Delivery

MAX_REASONS = 8
FOLLOWED = (
    *OBSERVED,
    topics.PERCEPTS,
    topics.ENERGY,
    topics.MOTOR_COMMAND,
    topics.BROADCAST,
    topics.HEALTH,
    topics.PAUSED,
)


class EnergyMetrics(msgspec.Struct, kw_only=True):
    """The level of the robot's battery, 0 to 1, at its lowest and at the end, how often it was
    charged, and whether the robot ran out of energy.
    """

    lowest: float
    final: float
    charged: int
    ran_out: bool


class EnergyTally:
    """Follows the energy that the body senses, if any; `charged` is how often it was charged."""

    def __init__(self) -> None:
        self.newest: Energy | None = None
        self.lowest = 1.0
        self.charged = 0

    def update(self, energy: Energy) -> None:
        """Take account of the energy with a view; what is not newer than before is ignored."""
        before = self.newest
        if before is not None and energy.stamp_ns <= before.stamp_ns:
            return

        was_charging = before is not None and before.is_charging
        self.charged += energy.is_charging and not was_charging
        self.lowest = min(self.lowest, energy.level)
        self.newest = energy

    @property
    def is_charging(self) -> bool:
        """Return whether the robot is being charged."""
        return self.newest is not None and self.newest.is_charging

    @property
    def is_out(self) -> bool:
        """Return whether the robot has run out of energy."""
        return self.lowest <= 0.0

    def metrics(self) -> EnergyMetrics | None:
        """Return the metrics of the energy; None if none was sensed."""
        if self.newest is None:
            return None

        return EnergyMetrics(
            lowest=self.lowest,
            final=self.newest.level,
            charged=self.charged,
            ran_out=self.is_out,
        )


class Tally:
    """Follows the messages on FOLLOWED of a run, live or from its log; `replica` has its graph.

    `cycle_ms`: of each command, the time from the stamping of its camera frame until it was
    received; `bus_ms`: the part of it spent in anything but computing. `refused`: why the last few
    answers of codelets were dropped. `forgotten`: the labels of objects that left the map as their
    activation had decayed. `percepts` has them all, and what each was given to. `halted` and
    `slowed`: how many commands stopped the robot or kept it below its cruising speed, by reason;
    `command` is the newest. `energy` is what the body sensed of it. `is_paused` is whether somebody
    lets time stand.
    """

    def __init__(self, replica: Replica) -> None:
        self.observer = Observer()
        self.percepts = PerceptTally()
        self.replica = replica
        self.cycle_ms = array("d")
        self.bus_ms = array("d")
        self.broadcasts = 0
        self.dropped = 0
        self.refused: deque[str] = deque(maxlen=MAX_REASONS)
        self.forgotten: list[str] = []
        self.halted: Counter[str] = Counter()
        self.slowed: Counter[str] = Counter()
        self.command: MotorCommand | None = None
        self.energy = EnergyTally()
        self.is_paused = False
        self.health: dict[str, Health] = {}
        self._busy: dict[str, float] = {}
        self._reports: Counter[str] = Counter()

    def receive(self, arrival: Arrival, intake: Intake) -> None:
        """Take account of an arrival; `intake` counts it if it is lost, or not valid."""
        message = intake.accept(arrival)
        if message is None or arrival.envelope is None:
            return
        try:
            self.update(message, arrival.envelope, arrival.received_ns)
        except MessageError as error:
            intake.reject(arrival.topic.name, str(error))

    def update(self, message: Message, envelope: Envelope, received_ns: int) -> None:
        """Take account of one message. Raises MessageError if it is not what its topic carries."""
        self.observer.update(message)
        self.percepts.update(message)
        match message:
            case Delta():
                self.dropped += message.rejected
                self.refused.extend(message.reasons)
                for operation in message.operations:
                    if isinstance(operation, DropNode):
                        node = self.replica.graph.get(Object, operation.id)  # it is there still
                        if node is not None:
                            self.forgotten.append(node.name or node.label)
                self.replica.follow(message)
            case Health():
                self.health[message.instance] = message
                self._busy[message.instance] = self._busy.get(message.instance, 0.0) + message.busy
                self._reports[message.instance] += 1
            case Broadcast():
                self.broadcasts += 1
            case Energy():
                self.energy.update(message)
            case Paused():
                self.is_paused = message.is_paused
            case MotorCommand():
                self._on_command(message, envelope, received_ns)

    def _on_command(self, command: MotorCommand, envelope: Envelope, received_ns: int) -> None:
        cycle_ns = received_ns - envelope.born_ns
        compute_ns = sum(compute for _, compute, _ in envelope.stages)
        bus_ns = cycle_ns - compute_ns
        self.cycle_ms.append(cycle_ns / 1e6)
        self.bus_ms.append(bus_ns / 1e6)

        self.command = command
        if command.halted_by:
            self.halted[command.halted_by.value] += 1
        elif command.slowed_by:
            self.slowed[command.slowed_by.value] += 1

    def share_limited_by(self, limit: SpeedLimit) -> float:
        """Compute the share of the commands that `limit` slowed or halted; 0 if there is none."""
        halted = self.halted[limit.value]
        slowed = self.slowed[limit.value]
        commands = max(1, len(self.cycle_ms))
        return (halted + slowed) / commands

    @property
    def busy(self) -> dict[str, float]:
        """Return the mean share of its time that each instance was computing."""
        return {name: total / self._reports[name] for name, total in sorted(self._busy.items())}

    def gaps(self, own: Counter[str]) -> dict[str, int]:
        """Count messages lost for good on each NEVER_DROP topic, by whoever lost most: a module, or
        this process with its `own` count.
        """
        reported = [health.gaps for health in self.health.values()]
        counts: list[Mapping[str, int]] = [own, *reported]

        names = [topic.name for topic in topics.ALL if topic.delivery is Delivery.NEVER_DROP]
        return {name: max(count.get(name, 0) for count in counts) for name in names}

    def rejected(self, own: Counter[str]) -> dict[str, int]:
        """Count messages that were rejected, by topic, summed over the modules and `own`."""
        total = own.copy()
        for health in self.health.values():
            total.update(health.rejected)
        return dict(sorted(total.items()))
