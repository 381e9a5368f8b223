"""One drive from start to end: processes up, the robot around its route, everything down again."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, field
from pathlib import Path

from cli.launch.plan import CONFIG_NAME, RECORDER, ROUTER, STATE_NAME, Choices, programs, to_toml
from cli.launch.supervisor import Supervisor
from cli.launch.watch import Watch
from cli.run.display import Display
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.runtime.config import Sections
from cogmap.runtime.process import Stop

PUMP_S = 0.05
SHOW_PERIOD_S = 0.25
GRACE_S = 3.0
QUIET_S = 0.3
ROUTE_COMPLETE = "route complete"
TIME_LIMIT = "time limit"
INTERRUPTED = "interrupted"


@dataclass
class Drive:
    """A run in `folder`, which holds its files, of the modules as configured in `sections`."""

    folder: Path
    connect: str
    agent: str
    choices: Choices
    sections: Sections
    began_s: float
    ended_by: str = ""
    start_s: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.supervisor = Supervisor(self.folder)

    def run(self, until_s: float, stop: Stop, display: Display) -> Watch:
        """Drive until the route is complete, `until_s` on the monotonic clock, or `stop`; all
        processes end.

        Raises UsageError in the words of a process that ended for a reason that the user can mend.
        """
        (self.folder / CONFIG_NAME).write_text(to_toml(self.sections))
        watch: Watch | None = None
        try:
            first, rest = programs(self.folder, self.connect, self.agent, self.choices)
            for program in first:
                self.supervisor.start(program)
            watch = Watch(ZenohBus(self.connect, self.agent))
            self._await_recorder(watch, until_s, stop)
            for program in rest:
                self.supervisor.start(program)
            self._note("processes started")
            self._follow(watch, until_s, stop, display)
            if self.sections["sim"]["mode"] == "lockstep" and self.ended_by == ROUTE_COMPLETE:
                watch.pump_until_quiet(QUIET_S)
        finally:
            self._end(watch)
        return watch

    def _await_recorder(self, watch: Watch, until_s: float, stop: Stop) -> None:
        """Wait for it, so that the log has what each module says from its first message on."""
        recorders = {RECORDER: 1} if self.choices.record else {}
        while watch.missing(recorders) and not self._has_ended(watch, until_s, stop):
            watch.pump(PUMP_S)
            self.supervisor.check()

    def _follow(self, watch: Watch, until_s: float, stop: Stop, display: Display) -> None:
        show_s = 0.0
        while not self._has_ended(watch, until_s, stop):
            watch.pump(PUMP_S)
            self.supervisor.check()
            missing = watch.missing(self.sections["sim"]["awaits"] | {"sim": 1})
            self._note_progress(watch, missing)
            if time.monotonic() < show_s:
                continue
            show_s = time.monotonic() + SHOW_PERIOD_S
            if watch.observer.start is None:
                display.waiting(missing)
            else:
                display.driving(watch.observer, watch.observer.errors())

    def _note_progress(self, watch: Watch, missing: list[str]) -> None:
        reached = {
            "all ready": not missing,
            "first pose": watch.observer.start,
            "first command": watch.cycle_ms,
        }
        for milestone, there in reached.items():
            if there:
                self._note(milestone)

    def _has_ended(self, watch: Watch, until_s: float, stop: Stop) -> bool:
        if stop.asked:
            self.ended_by = INTERRUPTED
        elif watch.observer.progress >= 1.0:
            self.ended_by = ROUTE_COMPLETE
        elif time.monotonic() >= until_s:
            self.ended_by = TIME_LIMIT
        return bool(self.ended_by)

    def _end(self, watch: Watch | None) -> None:
        """First what moves, then what thinks, then what records, the router last."""
        supervisor = self.supervisor
        supervisor.end(["sim"], GRACE_S)
        supervisor.end(
            [name for name in supervisor.children if name not in (RECORDER, ROUTER)], GRACE_S
        )
        if watch is not None:
            watch.pump(0.0)
            watch.close()
        supervisor.end([RECORDER], GRACE_S)
        supervisor.end([ROUTER], GRACE_S)
        shutil.rmtree(self.folder / STATE_NAME, ignore_errors=True)

    def _note(self, milestone: str) -> None:
        self.start_s.setdefault(milestone, round(time.monotonic() - self.began_s, 3))
