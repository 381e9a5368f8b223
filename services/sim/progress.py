"""How much of a drive is over. Pure."""

from __future__ import annotations

from cogmap.schemas.sensing import MotorCommand, SpeedLimit


class Progress:
    """The share of `duration_s` that has passed; all of it, where the drive `ends_at_goal`, once a
    command has halted the robot as every goal is reached.
    """

    def __init__(self, duration_s: float, ends_at_goal: bool) -> None:
        self._duration_ns = duration_s * 1e9
        self._ends_at_goal = ends_at_goal
        self._is_over = False

    def resume(self, share: float) -> None:
        """Continue from a share: what was over stays over."""
        self._is_over = share >= 1.0

    def on_command(self, command: MotorCommand) -> None:
        """Take account of a command that is obeyed."""
        if self._ends_at_goal and command.halted_by is SpeedLimit.AT_GOAL:
            self._is_over = True

    def at(self, now_ns: int) -> float:
        """The share at a time since the start."""
        if self._is_over:
            return 1.0
        return min(1.0, now_ns / self._duration_ns)
