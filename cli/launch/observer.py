"""Follows a drive from outside: its paths, its goals, and how much of it is over. Pure."""

from __future__ import annotations

from collections import deque

import numpy as np

from cogmap.cli.launch.goals import GoalProgress
from cogmap.evaluation.paths import FOLLOWED, Paths
from cogmap.geometry.arrays import Floats
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import TruePose, TrueTown

OBSERVED = (topics.TRUE_TOWN, *FOLLOWED)
MAX_REASONS = 8
MAX_POSES = 16_384
"""Of each path: 54 minutes at five views a second, and of a longer drive every second one."""
STREET_M = 8.0
"""Farther from all of its path so far, the robot is in a street new to it."""


class Played:
    """How much of a recording has been played: `recording` names it, and is empty where the drive
    is simulated. `reasons` say why the last of `skipped` views were left out, and what else was.
    """

    def __init__(self) -> None:
        self.recording = ""
        self.views = 0
        self.skipped = 0
        self.reasons: deque[str] = deque(maxlen=MAX_REASONS)

    def update(self, playback: Playback) -> None:
        """Take account of how far it is."""
        self.recording = playback.recording
        self.views = playback.views
        self.skipped = playback.skipped
        self.reasons.extend(playback.reasons)


class Observer(Paths):
    """Follows a drive from outside: its paths, its goals, and how much of it is over."""

    def __init__(self) -> None:
        super().__init__(MAX_POSES)
        self.town: TrueTown | None = None
        self.played = Played()
        self.place_m = (0.0, 0.0)
        self.has_ended = False
        self._share_of_time = 0.0
        self.recalled_m: float | None = None
        self._goals = GoalProgress()
        self._explored_ns = 0
        self._explored_m = 0.0
        self._began_ns: int | None = None
        self._now_ns = 0

    def update(self, message: Message) -> None:
        """Take account of one message; one that does not concern the drive is ignored.

        Raises MessageError if it is not what its topic carries.
        """
        super().update(message)
        match message:
            case TruePose():
                self.place_m = (message.pose.x_m, message.pose.y_m)
                self._tick(message.stamp_ns, message.progress)
            case Delta():
                self._on_delta(message)
            case TrueTown():
                self.town = message
            case Playback():
                self.played.update(message)
                self._tick(message.stamp_ns, message.progress)

    def _tick(self, stamp_ns: int, share: float) -> None:
        """Note that so much of the drive's time has passed."""
        if self._began_ns is None:
            self._began_ns = stamp_ns
        self._now_ns = max(self._now_ns, stamp_ns)
        self.has_ended = share >= 1.0
        self._share_of_time = share

    def _on_delta(self, delta: Delta) -> None:
        self._goals.update(delta, self.travelled_m)
        if not self.goals:
            self._explored_ns = self._now_ns
            self._explored_m = self.travelled_m

        if self.recalled and self.recalled_m is None:
            self.recalled_m = self.travelled_m

    @property
    def has_begun(self) -> bool:
        """Return whether the robot has been somewhere, or a recording is being played."""
        return self._began_ns is not None

    @property
    def goals(self) -> int:
        """Return how many goals the agent has."""
        return self._goals.count

    @property
    def goals_reached(self) -> int:
        """Return how many of its goals the agent has reached."""
        return self._goals.reached

    @property
    def progress(self) -> float:
        """Return the share of its goals that the agent has reached, the way to the next one
        included; if it has none, the share of the drive's time that has passed.
        """
        if not self.goals:
            return self._share_of_time
        return self._goals.share(self.travelled_m)

    @property
    def now_s(self) -> float:
        """Return the simulated time."""
        return self._now_ns / 1e9

    @property
    def elapsed_s(self) -> float:
        """Return the time of the drive so far, by the stamps of its messages."""
        began_ns = self._now_ns if self._began_ns is None else self._began_ns
        elapsed_ns = self._now_ns - began_ns
        return max(0, elapsed_ns) / 1e9

    @property
    def shortcuts_m(self) -> Floats:
        """Return the (n, 2, 2) steps of the true path to goals through streets that the robot had
        not been in before it had any; none if it had goals before it had left its first street.
        """
        if not self.goals or self._explored_m < STREET_M:
            return np.zeros((0, 2, 2))
        return self._true.new_since_m(self._explored_ns, STREET_M)
