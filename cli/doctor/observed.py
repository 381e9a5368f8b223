"""Collects what the processes of a system report about themselves in a few seconds."""

from __future__ import annotations

from dataclasses import dataclass, field

from cogmap.bus.interface import Member
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Health, Paused
from cogmap.schemas.sensing import MotorCommand, SpeedLimit


@dataclass
class Observed:
    """The observations: who is `ready` on the bus, and who has `left` it meanwhile; `health` has
    each instance's reports in order; `clock_rate` is simulated seconds a second, None if no clock
    was received.

    `busy` is the share of this machine's processors that were computing. So many of the `commands`
    were `limited` by the age of their poses. `is_paused` is whether time stands by a wish.
    """

    ready: set[Member] = field(default_factory=set)
    health: dict[str, list[Health]] = field(default_factory=dict)
    clock_rate: float | None = None
    left: set[Member] = field(default_factory=set)
    busy: float = 0.0
    commands: int = 0
    limited: int = 0
    is_paused: bool = False

    def note(self, member: Member, alive: bool) -> None:
        """Take account of a member that is there, or has left."""
        if alive:
            self.ready.add(member)
            self.left.discard(member)
        else:
            self.ready.discard(member)
            self.left.add(member)

    def add(self, message: Message | None) -> None:
        """Count a report, a clock or a command; other messages are ignored."""
        match message:
            case Health() as health:
                self.health.setdefault(health.instance, []).append(health)
            case Clock() as clock:
                self.clock_rate = clock.rate
            case Paused() as paused:
                self.is_paused = paused.is_paused
            case MotorCommand() as command:
                self.commands += 1
                self.limited += SpeedLimit.POSE_AGE in {command.halted_by, command.slowed_by}
