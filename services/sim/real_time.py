"""Simulated time in real time: it follows the wall's. Pure."""

from __future__ import annotations

from collections import deque

from cogmap.errors import MessageError
from cogmap.runtime.pausing import Pausing
from cogmap.schemas.base import Message
from cogmap.schemas.process import Pause
from cogmap.schemas.sensing import MotorCommand
from cogmap.services.sim.simulation import Simulation

# At most so much is caught up at once: five ticks of the odometry.
CATCH_UP_NS = 250_000_000
# How often the town is published, for those who join later; the time that the rate is of.
TOWN_PERIOD_NS = 5_000_000_000
RATE_WINDOW_NS = 1_000_000_000

COMMAND_TIMEOUT_NS = 1_000_000_000
"""Simulated time without a motor command after which the wheels stop: five frames."""

MAX_COMMAND_AGE_NS = 2_500_000_000
"""Age of a command's stamp beyond which it moves no wheel: the robot has moved 10 m since what it
answers.
"""


class RealTime:
    """Advances `simulation` with the wall's time. If more than CATCH_UP_NS would have to be
    caught up, it falls behind instead.

    A command older than MAX_COMMAND_AGE_NS moves no wheel: it is refused when it arrives, and the
    wheels stop when it becomes so old. They also stop when none arrives for COMMAND_TIMEOUT_NS.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._pausing = Pausing()
        self._is_started = False
        self._behind_ns = 0
        self._wall_ns: int | None = None
        self._history: deque[tuple[int, int]] = deque()
        self._command_ns = 0
        self._arrived_ns = 0

    def on_start(self) -> None:
        """Let time begin with the next timer."""
        self._is_started = True

    def on_command(self, command: MotorCommand) -> None:
        """Obey the newest command; one that arrives after a newer one is ignored. Raises
        MessageError if it is too old.
        """
        now_ns = self._simulation.now_ns
        if command.stamp_ns > now_ns or command.stamp_ns < self._command_ns:
            return

        age_ns = now_ns - command.stamp_ns
        if age_ns > MAX_COMMAND_AGE_NS:
            raise MessageError(
                f"motor command: it is {age_ns / 1e9:.1f} s old, and the wheels obey none older "
                f"than {MAX_COMMAND_AGE_NS / 1e9:g} s: lower the frame rate or use a faster machine"
            )

        self._command_ns = command.stamp_ns
        self._arrived_ns = now_ns
        self._simulation.drive(command)

    def on_pause(self, pause: Pause) -> list[Message]:
        """Return whether time stands now."""
        self._pausing.on_pause(pause)
        return [self._pausing.said(self._simulation.now_ns)]

    def on_timer(self, wall_ns: int) -> list[Message]:
        """Return all that happens until `wall_ns`, which is monotonic. While time stands, that is
        nothing, or what happens up to the next frame if that is to come.

        The first call adds the time up to the first frame: the robot stands until then, as nobody
        can command it without a view.
        """
        if not self._is_started:
            return []

        simulation = self._simulation
        tick_ns = simulation.tick_ns
        period_ns = simulation.ticks_per_frame * tick_ns
        to_frame_ns = period_ns - simulation.now_ns % period_ns
        messages: list[Message] = []
        if self._pausing.is_paused:
            self._behind_ns = to_frame_ns if self._pausing.takes_step() else 0
            messages += self._pausing.said_again(simulation.now_ns, wall_ns)
        else:
            passed_ns = to_frame_ns if self._wall_ns is None else wall_ns - self._wall_ns
            self._behind_ns = min(self._behind_ns + passed_ns, CATCH_UP_NS)
        self._wall_ns = wall_ns

        has_moved = self._behind_ns >= tick_ns
        is_frame_due = False
        while self._behind_ns >= tick_ns:
            now_ns = simulation.now_ns
            is_silent = now_ns - self._arrived_ns >= COMMAND_TIMEOUT_NS
            is_old = now_ns - self._command_ns > MAX_COMMAND_AGE_NS
            if is_silent or is_old:
                simulation.brake()

            if now_ns % TOWN_PERIOD_NS == 0:
                messages.append(simulation.town())
            messages += simulation.step()
            self._behind_ns -= tick_ns
            is_frame_due |= simulation.now_ns % period_ns == 0

        if has_moved:
            rate = self._rate(wall_ns)
            messages += [simulation.clock(rate), simulation.truth()]
            messages += simulation.changed_town()

        if is_frame_due:
            messages += simulation.view()

        return messages

    def _rate(self, wall_ns: int) -> float:
        """Return simulated time over the wall's in the last second."""
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
