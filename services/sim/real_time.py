"""Simulated time in real time: it follows the wall's. Pure."""

from __future__ import annotations

from collections import deque

from cogmap.errors import MessageError
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import MotorCommand
from cogmap.services.sim.simulation import Simulation

CATCH_UP_NS = 250_000_000
TOWN_PERIOD_NS = 5_000_000_000
RATE_WINDOW_NS = 1_000_000_000


class RealTime:
    """Advances `simulation` with the wall's time. Where more than CATCH_UP_NS would have to be
    caught up, it falls behind instead.

    A command older than `max_age_s` moves no wheel: it is refused when it arrives, and the wheels
    stop when it becomes so old. They also stop when none arrives for `timeout_s`.
    """

    def __init__(self, simulation: Simulation, timeout_s: float, max_age_s: float) -> None:
        self._simulation = simulation
        self._timeout_ns = round(timeout_s * 1e9)
        self._max_age_ns = round(max_age_s * 1e9)
        self._is_started = False
        self._behind_ns = 0
        self._wall_ns: int | None = None
        self._history: deque[tuple[int, int]] = deque()
        self._command_ns = 0
        self._arrived_ns = 0

    def on_start(self) -> None:
        """Time begins with the next timer."""
        self._is_started = True

    def on_command(self, command: MotorCommand) -> None:
        """Obey the newest command; one that arrives after a newer one is ignored. Raises
        MessageError where it is too old.
        """
        now_ns = self._simulation.now_ns
        if command.stamp_ns > now_ns or command.stamp_ns < self._command_ns:
            return

        age_ns = now_ns - command.stamp_ns
        if age_ns > self._max_age_ns:
            raise MessageError(
                f"motor command: it is {age_ns / 1e9:.1f} s old, and the wheels obey none older "
                f"than {self._max_age_ns / 1e9:g} s: lower the frame rate or use a faster machine"
            )

        self._command_ns = command.stamp_ns
        self._arrived_ns = now_ns
        self._simulation.drive(command)

    def on_timer(self, wall_ns: int) -> list[Message]:
        """All that happens until `wall_ns`, which is monotonic."""
        if not self._is_started:
            return []

        self._fall_behind(wall_ns)
        messages: list[Message] = []
        is_frame_due = False
        while self._behind_ns >= self._simulation.tick_ns:
            messages += self._tick()
            is_frame_due |= self._is_at_frame()

        if messages:
            rate = self._rate(wall_ns)
            messages += [self._simulation.clock(rate), self._simulation.truth()]
            messages += self._changed_town()

        if is_frame_due:
            messages += self._simulation.view()

        return messages

    def _changed_town(self) -> list[Message]:
        """The town, where it has changed since the last call."""
        changed = self._simulation.changed_town()
        return [] if changed is None else [changed]

    def _fall_behind(self, wall_ns: int) -> None:
        """Add the wall's time since the last call to what is behind.

        The first call adds the time up to the first frame: the robot stands until then, as nobody
        can command it without a view.
        """
        if self._wall_ns is None:
            self._behind_ns = min(self._to_frame_ns(), CATCH_UP_NS)
        else:
            passed_ns = wall_ns - self._wall_ns
            self._behind_ns = min(self._behind_ns + passed_ns, CATCH_UP_NS)

        self._wall_ns = wall_ns

    def _to_frame_ns(self) -> int:
        """The simulated time up to the next frame."""
        simulation = self._simulation
        period_ns = simulation.ticks_per_frame * simulation.tick_ns
        return period_ns - simulation.now_ns % period_ns

    def _tick(self) -> list[Message]:
        """Advance by one tick: its odometry, after the town where that is due."""
        simulation = self._simulation
        if self._is_command_over():
            simulation.brake()

        is_town_due = simulation.now_ns % TOWN_PERIOD_NS == 0
        town: list[Message] = [simulation.town()] if is_town_due else []
        self._behind_ns -= simulation.tick_ns

        return [*town, simulation.tick()]

    def _is_command_over(self) -> bool:
        now_ns = self._simulation.now_ns
        is_silent = now_ns - self._arrived_ns >= self._timeout_ns
        is_old = now_ns - self._command_ns > self._max_age_ns

        return is_silent or is_old

    def _is_at_frame(self) -> bool:
        simulation = self._simulation
        return simulation.now_ns // simulation.tick_ns % simulation.ticks_per_frame == 0

    def _rate(self, wall_ns: int) -> float:
        """Simulated time over the wall's in the last second."""
        history = self._history
        history.append((wall_ns, self._simulation.now_ns))
        while len(history) > 2 and wall_ns - history[0][0] > RATE_WINDOW_NS:
            history.popleft()

        first_wall_ns, first_ns = history[0]
        passed_ns = wall_ns - first_wall_ns
        if not passed_ns:
            return 1.0

        simulated_ns = self._simulation.now_ns - first_ns

        return simulated_ns / passed_ns
