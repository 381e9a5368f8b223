"""One drive from start to end: processes started, the robot driven, every process ended."""

from __future__ import annotations

import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from cogmap.bus.access.subjects import DRIVE
from cogmap.bus.session import free_port, listens
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.launch.display import Display
from cogmap.cli.launch.forking.client import ForkServer
from cogmap.cli.launch.guide import Guide, Stage
from cogmap.cli.launch.observer import Observer
from cogmap.cli.launch.outcome import Ending, Outcome
from cogmap.cli.launch.plan import (
    CONFIG_NAME,
    RECORDER,
    ROUTER,
    STATE_NAME,
    Choices,
    dashboard,
    programs,
    to_toml,
)
from cogmap.cli.launch.supervisor import Supervisor
from cogmap.cli.launch.tally import Tally
from cogmap.cli.launch.watch import Watch
from cogmap.cli.launch.watchdog import MAX_SHARE_SLOWED, REMEDY, Situation, Watchdog
from cogmap.cli.options import DASHBOARD_PORT
from cogmap.errors import ProcessFailedError
from cogmap.recording.completeness import Published
from cogmap.runtime import environment
from cogmap.runtime.config import Sections
from cogmap.runtime.process import Stop
from cogmap.runtime.state.published import published_in
from cogmap.schemas.sensing import SpeedLimit
from cogmap.services import registry

PUMP_S = 0.05
SHOW_PERIOD_S = 0.25
GRACE_S = 3.0
QUIET_S = 0.3
MAX_NAMES = 8
FINISH_S = 4.0
FIRST_POSE = "first pose"


@dataclass
class Drive:
    """A run in `folder`, which holds its files, of the modules as configured in `sections`, at the
    router `endpoint`. Where there is a `server`, it forks them.

    It may take `limit_s` of wall-clock time from `began_s` on or, unless `limits_start`, from its
    first pose on: then a slow start takes nothing from the drive. While somebody lets time stand,
    nothing is counted.
    """

    folder: Path
    endpoint: str
    agent: str
    choices: Choices
    sections: Sections
    began_s: float
    limit_s: float
    limits_start: bool
    server: ForkServer | None = None
    start_s: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.supervisor = Supervisor(self.folder, self.server)
        self._watchdog = Watchdog()
        self._dashboard_port: int | None = None
        self._has_shown_dashboard = False
        self._paused_s = 0.0
        self.published: Published = {}
        self.guide: Guide | None = None
        if self.choices.tour:
            self.guide = Guide(self.choices.explores_s, self.choices.goals)

    @property
    def participants(self) -> Mapping[str, int]:
        """Return how many instances of each module take part."""
        participants: dict[str, int] = self.sections["run"]["participants"]
        return participants

    def run(self, stop: Stop, display: Display) -> tuple[Watch, Ending]:
        """Drive until every goal is reached, the time of the drive is over, it cannot succeed,
        its time limit has come, or `stop` was asked; then end every process.

        Raises ProcessFailedError, with its last words, if a process failed before the drive had
        begun, and KeyboardInterrupt if `stop` was asked before a router answered.
        """
        config = to_toml(self.sections)
        (self.folder / CONFIG_NAME).write_text(config, encoding="utf-8")
        watch: Watch | None = None
        try:
            for program in programs(self.folder, self.endpoint, self.agent, self.choices):
                self.supervisor.start(program)
            self._note("processes started")
            keys = environment.keys(DRIVE)
            bus = ZenohBus(self.endpoint, self.agent, lambda: stop.asked, keys)
            watch = Watch(bus)
            ending = self._drive(watch, stop, display)
        finally:
            self._close(watch)
        return watch, ending

    def is_over_limit(self) -> bool:
        """Return whether only the time to end it is left of its time limit."""
        counted_from_s = self.began_s
        if not self.limits_start:
            counted_from_s += self.start_s.get(FIRST_POSE, 0.0)
        counted_from_s += self._paused_s
        return time.monotonic() >= counted_from_s + self.limit_s - FINISH_S

    def _drive(self, watch: Watch, stop: Stop, display: Display) -> Ending:
        observer = watch.tally.observer
        try:
            ending = self._await_recorder(watch, stop)
            if ending is None:
                self.supervisor.release()
                ending = self._follow(watch, stop, display)
        except ProcessFailedError as error:
            if not observer.has_begun:
                raise
            return Ending(Outcome.MODULE_FAILED, str(error))

        if self.sections["run"]["lockstep"] and observer.has_ended:
            watch.pump_until_quiet(QUIET_S)
        return ending

    def _await_recorder(self, watch: Watch, stop: Stop) -> Ending | None:
        """Wait for it, so that the log holds every message of each module from its first on.

        Returns how the drive ended meanwhile, if it did.
        """
        recorders = {RECORDER: 1} if self.choices.record else {}
        while missing := watch.missing(recorders):
            ending = self._ending(watch, missing, stop)
            if ending is not None:
                return ending
            watch.pump(PUMP_S)
            self.supervisor.check()
        return None

    def _follow(self, watch: Watch, stop: Stop, display: Display) -> Ending:
        """Guide the agent, restart what dies and show the progress until the drive must end."""
        tally = watch.tally
        observer = tally.observer
        show_s = 0.0
        shown: Stage | None = None
        missing = watch.missing(self.participants)
        while (ending := self._ending(watch, missing, stop)) is None:
            pumped_s = time.monotonic()
            watch.pump(PUMP_S)
            if tally.is_paused:
                self._paused_s += time.monotonic() - pumped_s
            if self.guide is not None:
                for message in self.guide.step(observer, tally.replica.graph):
                    watch.publish(message)

            self.supervisor.check()
            missing = watch.missing(self.participants)
            if not missing:
                self._note("all ready")
            if observer.has_begun:
                self._note(FIRST_POSE)
            if tally.cycle_ms:
                self._note("first command")
                self._serve_dashboard(display)

            if time.monotonic() < show_s:
                continue
            show_s = time.monotonic() + SHOW_PERIOD_S
            if not observer.has_begun:
                display.waiting(missing)
            else:
                display.driving(observer, observer.errors())
            if self.guide is not None and self.guide.stage is not shown:
                shown = self.guide.stage
                display.show(self.guide.sentence)
        return ending

    def _serve_dashboard(self, display: Display) -> None:
        """Serve the dashboard, once the start of the others takes no longer for it, and name its
        address once it answers there.
        """
        if not self.choices.dashboard or self._has_shown_dashboard:
            return

        if self._dashboard_port is None:
            self._dashboard_port = free_port(DASHBOARD_PORT)
            opens = self.choices.opens_dashboard
            served = dashboard(self.endpoint, self.agent, self._dashboard_port, opens)
            self.supervisor.start(served)
        elif listens(self._dashboard_port):
            self._has_shown_dashboard = True
            display.show(f"dashboard: http://127.0.0.1:{self._dashboard_port}")

    def _note(self, milestone: str) -> None:
        """Keep when a milestone was reached for the first time."""
        elapsed_s = time.monotonic() - self.began_s
        self.start_s.setdefault(milestone, round(elapsed_s, 3))

    def _ending(self, watch: Watch, missing: list[str], stop: Stop) -> Ending | None:
        """Decide how the drive must end now; None while it continues."""
        tally = watch.tally
        observer = tally.observer
        if stop.asked:
            return Ending(Outcome.INTERRUPTED, "interrupted by Ctrl-C")
        if self.guide is not None and self.guide.stage is Stage.COMPLETE:
            return Ending(Outcome.ROUTE_COMPLETE, self.guide.sentence)
        if observer.has_ended:
            return self._ending_of_simulation(observer)
        if self.is_over_limit():
            return _out_of_time(tally, missing)
        if not observer.has_begun:
            return None

        command = tally.command
        situation = Situation(
            now_s=time.monotonic(),
            drive_s=observer.elapsed_s,
            place_m=observer.place_m,
            commands=len(tally.cycle_ms),
            halted_by=command.halted_by if command else SpeedLimit.NONE,
            missing=missing,
            is_charging=tally.energy.is_charging,
            is_out=tally.energy.is_out,
            is_recorded=bool(self.choices.recording),
            is_paused=tally.is_paused,
        )
        return self._watchdog.check(situation)

    def _ending_of_simulation(self, observer: Observer) -> Ending:
        """Say how a drive ended whose simulation has: at its goals, or as its time is over; or its
        recording.
        """
        if self.choices.recording:
            return Ending(Outcome.RECORDING_OVER, _played(observer))

        sim = self.sections["sim"]
        if not sim["ends_at_goal"] and self.guide is None:
            return Ending(Outcome.ROUTE_COMPLETE, "the time of the drive is over")
        if observer.now_s < sim["duration_s"]:
            return Ending(Outcome.ROUTE_COMPLETE, f"the agent was at every goal: {self.goals}")
        return Ending(
            Outcome.TIME_LIMIT,
            f"the {sim['duration_s']:g} s of the drive were over at {_reached(observer)}: "
            "a higher sim.duration_s allows more",
        )

    @property
    def goals(self) -> str:
        """Return the goals that the agent has from its start, the first of them by name."""
        names = [goal["name"] for goal in self.sections["workspace"]["goals"]]
        named = ", ".join(names[:MAX_NAMES])
        more = len(names) - MAX_NAMES
        return f"{named} and {more} more" if more > 0 else named

    def _close(self, watch: Watch | None) -> None:
        """End first what moves, then what thinks, then what records, the router last."""
        supervisor = self.supervisor
        supervisor.end(registry.BODIES, GRACE_S)
        supervisor.end(set(supervisor.children) - {RECORDER, ROUTER}, GRACE_S)
        if watch is not None:
            watch.pump(0.0)
            watch.close()
        supervisor.end([RECORDER], GRACE_S)
        supervisor.end([ROUTER], GRACE_S)
        self.published = published_in(self.folder / STATE_NAME)
        if not self.choices.without:  # modules of others may still write there
            shutil.rmtree(self.folder / STATE_NAME, ignore_errors=True)


def _played(observer: Observer) -> str:
    """Say that all of a recording was played, and how many views of it could not be."""
    played = observer.played
    views = f"all of {played.recording} was played, {played.views} views"
    if not played.skipped:
        return views
    return f"{views}, {played.skipped} left out, the last one as {played.reasons[-1]}"


def _out_of_time(tally: Tally, missing: list[str]) -> Ending:
    """Say how a drive ends at its time limit: because of what it waits for, or its speed."""
    if missing:
        names = ", ".join(missing)
        waited = f"the time limit came while it waited for {names}: see its log"
        return Ending(Outcome.TIME_LIMIT, waited)

    came = f"the time limit came at {_reached(tally.observer)}"
    share = tally.share_limited_by(SpeedLimit.POSE_AGE)
    if share > MAX_SHARE_SLOWED:
        slow = f"{came}: the robot drove slowly, as {share:.0%} of its poses were old: {REMEDY}"
        return Ending(Outcome.TOO_SLOW, slow)
    return Ending(Outcome.TIME_LIMIT, f"{came}: --time-limit allows more")


def _reached(observer: Observer) -> str:
    """Say how far a drive is."""
    if observer.goals:
        return f"{observer.goals_reached} of {observer.goals} goals"
    return f"{observer.progress:.0%} of its time"
