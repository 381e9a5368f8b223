"""Our own logs: what the simulation, or a player, published in a recorded run is played again."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path

from cogmap.errors import LogError, MessageError
from cogmap.recording.log import recorded_config
from cogmap.recording.storage.format import MEMBER
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.runtime.config import Sections
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Pose, TruePose, TrueTown
from cogmap.services.player.config import Config

BODIES = ("sim", "player")
BESIDE = (topics.ODOMETRY, topics.SELF_MOTION, topics.SCAN, topics.ENERGY)
"""What is sensed beside views, in the order of one stamp."""

TRUTH = (topics.TRUE_POSE, topics.TRUE_TOWN)
OF_SENSES = ("sensory", "codelets")
"""The sections of a configuration that say what senses the robot had, and what they err by."""


@dataclass(frozen=True, slots=True)
class _Sensed:
    """A message that the body published, where it is in the log, and its stamp."""

    stamp_ns: int
    record: Record


class OwnLog:
    """The views of a log, at the times of its drive: stereo frames, or percepts where its robot had
    no cameras.
    """

    def __init__(self, path: Path) -> None:
        self._reader = LogReader(path)
        sensed = _of_body(self._reader)
        frames = [each for each in sensed if each.record.topic is topics.STEREO]
        percepts = [each for each in sensed if each.record.topic is topics.PERCEPTS]
        self._views = _rising(frames or percepts)
        if not self._views:
            raise LogError(
                f"{path} holds no views that a simulation or a player published: record a whole "
                "drive by `cogmap run`, and play its log.mcap"
            )

        self.stamps_ns = [each.stamp_ns for each in self._views]
        self._beside = sorted(
            (each for each in sensed if each.record.topic in BESIDE),
            key=lambda each: (each.stamp_ns, BESIDE.index(each.record.topic)),
        )
        self._beside_ns = [each.stamp_ns for each in self._beside]
        self._truth = [each for each in sensed if each.record.topic in TRUTH]
        self.true_poses = self._true_poses()
        self.settings = _settings(self._reader)
        self.notes: list[str] = []

    def before(self, number: int) -> list[Message]:
        """Return what was sensed after the view before, until this one. Raises LogError if it is
        damaged.
        """
        after_ns = self.stamps_ns[number - 1] if number else -1
        first = bisect_left(self._beside_ns, after_ns + 1)
        end = bisect_left(self._beside_ns, self.stamps_ns[number] + 1)
        return [self._message(each.record) for each in self._beside[first:end]]

    def view(self, number: int) -> list[Message]:
        """Return a view. Raises LogError if it is damaged."""
        return [self._message(self._views[number].record)]

    def town(self) -> TrueTown | None:
        """Return the town as it was in the beginning; None if the log has none."""
        for each in self._truth:
            if each.record.topic is topics.TRUE_TOWN:
                town = self._message(each.record)
                assert isinstance(town, TrueTown)
                return town
        return None

    def _true_poses(self) -> list[Pose | None]:
        """Return where the robot really was at each view, as far as the log says."""
        poses: dict[int, Pose] = {}
        for each in self._truth:
            if each.record.topic is topics.TRUE_POSE:
                true = self._message(each.record)
                assert isinstance(true, TruePose)
                poses[each.stamp_ns] = true.pose
        return [poses.get(stamp_ns) for stamp_ns in self.stamps_ns]

    def _message(self, record: Record) -> Message:
        try:
            return self._reader.message(record)
        except MessageError as error:
            raise LogError(f"{self._reader.path}: a message cannot be read: {error}") from None


def opened(path: Path, config: Config) -> OwnLog:
    """Open a log. Raises LogError if it is none, is damaged, or holds no views."""
    return OwnLog(path)


def _of_body(reader: LogReader) -> list[_Sensed]:
    """Return what the body published, in the order of the log. Raises LogError."""
    members = [facts for name, facts in reader.metadata if name == MEMBER]
    modules = {facts.get("instance", ""): facts.get("module", "") for facts in members}

    wanted = {topics.STEREO, topics.PERCEPTS, *BESIDE, *TRUTH}
    found = []
    for record in reader.records(wanted):
        stub = reader.stub(record)
        if modules.get(stub.source, stub.source) in BODIES:
            found.append(_Sensed(stub.stamp_ns, record))
    return found


def _rising(views: list[_Sensed]) -> list[_Sensed]:
    """Leave out views that were published again, as one is that nobody had answered."""
    rising: list[_Sensed] = []
    for each in views:
        if not rising or each.stamp_ns > rising[-1].stamp_ns:
            rising.append(each)
    return rising


def _settings(reader: LogReader) -> Sections:
    """Return the settings of the recorded run that its senses asked for."""
    recorded = recorded_config(reader)
    settings: Sections = {name: dict(recorded.get(name, {})) for name in OF_SENSES}
    settings["run"] = {"energy": bool(recorded.get("run", {}).get("energy", False))}
    return settings
