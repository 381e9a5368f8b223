"""Where a recording is played now. Pure, but for the files that the recording reads."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from msgspec.structs import replace

from cogmap.errors import UsageError
from cogmap.schemas.base import Message
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import TruePose
from cogmap.services.player.recording import Recording


class Step(NamedTuple):
    """A view at `stamp_ns`, what was sensed `before` it, in order of time, and what observers are
    told of it.
    """

    stamp_ns: int
    before: list[Message]
    truth: list[Message]
    view: list[Message]


class Playhead:
    """Moves through `recording`, which observers know by `name`, one readable view at a time.

    A view that cannot be read is left out and counted; what was sensed beside it is not.
    """

    def __init__(self, recording: Recording, name: str) -> None:
        self._recording = recording
        self._name = name
        self._travelled_m = _travelled_m(recording)
        self._views = 0
        self._skipped = 0
        self._reasons: list[str] = [*recording.notes]
        self.is_over = False
        self.is_resumed = False

    def resume(self, past: Iterable[Message]) -> None:
        """Continue after the last view that was published; what was over stays over."""
        for message in past:
            if isinstance(message, Playback):
                self.is_resumed = True
                self._reasons = []
                self._views = message.views
                self._skipped = message.skipped
                self.is_over = message.progress >= 1.0

    @property
    def begins_ns(self) -> int:
        """Return when the next view was sensed, or the last one if none is left."""
        stamps_ns = self._recording.stamps_ns
        return stamps_ns[min(self._number, len(stamps_ns) - 1)]

    @property
    def _number(self) -> int:
        """Return how many views are behind it, which is the number of the next one."""
        return self._views + self._skipped

    def advance(self) -> Step | None:
        """Return the next view that can be read; None if there is none."""
        recording = self._recording
        before: list[Message] = []
        while self._number < len(recording.stamps_ns):
            number = self._number
            try:
                before += recording.before(number)
                view = recording.view(number)
            except UsageError as error:
                self._skipped += 1
                self._reasons.append(str(error))
                continue

            self._views += 1
            truth = [*self._true_pose(number), self._with_reasons()]
            return Step(recording.stamps_ns[number], before, truth, view)

        return None

    def end(self) -> Playback:
        """Let the recording be over."""
        self.is_over = True
        return self._with_reasons()

    def played(self) -> Playback:
        """Return how much has been played."""
        stamps_ns = self._recording.stamps_ns
        last = max(0, self._number - 1)
        return Playback(
            stamp_ns=stamps_ns[last],
            recording=self._name,
            views=self._views,
            skipped=self._skipped,
            progress=1.0 if self.is_over else last / len(stamps_ns),
        )

    def town(self) -> list[Message]:
        """Return what really stood there, if that is known."""
        town = self._recording.town()
        return [] if town is None else [town]

    def _with_reasons(self) -> Playback:
        """Return how much has been played, with the reasons that were not given yet."""
        reasons = self._reasons
        self._reasons = []
        return replace(self.played(), reasons=reasons)

    def _true_pose(self, number: int) -> list[Message]:
        """Return where the robot really was at a view, if that is known."""
        pose = self._recording.true_poses[number]
        if pose is None:
            return []

        stamps_ns = self._recording.stamps_ns
        true = TruePose(
            stamp_ns=stamps_ns[number],
            pose=pose,
            travelled_m=self._travelled_m[number],
            progress=number / len(stamps_ns),
        )
        return [true]


def _travelled_m(recording: Recording) -> list[float]:
    """Add up how far the robot had come at each view, along the true poses that are known."""
    travelled_m: list[float] = []
    total_m = 0.0
    last = None
    for pose in recording.true_poses:
        if pose is not None and last is not None:
            total_m += math.hypot(pose.x_m - last.x_m, pose.y_m - last.y_m)
        travelled_m.append(total_m)
        last = pose or last

    return travelled_m
