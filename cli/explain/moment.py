"""One moment of a drive: all that a log holds of one cognitive cycle, from view to wheels."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cogmap.cli.explain.reading import Entered, Logged, Reading
from cogmap.recording.log import Log
from cogmap.runtime import config
from cogmap.schemas.cognition import Action, Broadcast, Coalitions, Competition, Fate
from cogmap.schemas.graph import Delta
from cogmap.schemas.sensing import MotorCommand, Percepts, View
from cogmap.services.global_workspace.config import Config


@dataclass(frozen=True)
class Moment:
    """The cycle `cycle`, whose view is of `stamp_ns`; None and nothing for what the log lacks.

    `entered` has the coalitions that competed, by id. `broadcast` and `action` are of this cycle,
    `earlier_broadcast` and `earlier_action` the last ones before it. `command` is the first that
    followed the action, or the one that answers the view where no action was selected. `settings`
    are those that the global workspace was recorded with.
    """

    path: Path
    cycle: int
    stamp_ns: int
    view: Logged[View] | None
    percepts: Logged[Percepts] | None
    deltas: list[Logged[Delta]]
    coalitions: Logged[Coalitions] | None
    competition: Logged[Competition] | None
    entered: dict[str, Entered]
    broadcast: Logged[Broadcast] | None
    earlier_broadcast: Logged[Broadcast] | None
    action: Logged[Action] | None
    earlier_action: Logged[Action] | None
    command: Logged[MotorCommand] | None
    settings: Config

    @property
    def driven_s(self) -> float:
        """Return when the view was taken, in seconds of the drive."""
        return self.stamp_ns / 1e9

    @property
    def at_s(self) -> float:
        """Return when the first message of the cycle was received, in seconds into the log."""
        of_cycle = [*self.deltas, self.competition]
        return min(logged.time_s for logged in of_cycle if logged is not None)

    @property
    def winner(self) -> str:
        """Return the id of the coalition that was broadcast in this cycle; empty if none was."""
        if self.competition is not None:
            for contender in self.competition.message.contenders:
                if contender.fate is Fate.WON:
                    return contender.id
        if self.broadcast is None:
            return ""
        return self.broadcast.message.coalition.id


def moment(log: Log, cycle: int, stamp_ns: int) -> Moment:
    """Read all that `log` holds of cycle `cycle`, whose view is of `stamp_ns`.

    Raises LogError if the log is damaged, ConfigError if its settings are not valid.
    """
    reading = Reading(log, cycle, stamp_ns)
    competition = reading.of_cycle(Competition)
    action = reading.of_cycle(Action)
    return Moment(
        path=log.path,
        cycle=cycle,
        stamp_ns=stamp_ns,
        view=reading.of_view(View),
        percepts=reading.of_view(Percepts),
        deltas=reading.deltas(),
        coalitions=reading.of_cycle(Coalitions),
        competition=competition,
        entered=reading.entered(competition),
        broadcast=reading.of_cycle(Broadcast),
        earlier_broadcast=reading.before_cycle(Broadcast),
        action=action,
        earlier_action=reading.before_cycle(Action),
        command=reading.command(action),
        settings=config.recorded(log.config, "global_workspace", Config),
    )
