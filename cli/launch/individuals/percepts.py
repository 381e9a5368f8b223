"""Keeps the percepts of a drive, and which object of the map each was given to. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from cogmap.evaluation.track import Track
from cogmap.geometry.arrays import Floats
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, DropNode, Link, Links, Phase
from cogmap.schemas.nodes import SATISFIED_BY, LinkKind, Object, Percept
from cogmap.schemas.sensing import Calibration, Percepts, TruePose


@dataclass(slots=True)
class Sight:
    """A percept of the view of `stamp_ns`; `label` is what its node in the graph is called, and
    `object` the id of the node that it was given to, empty if it was given to none. `outline` packs
    `outline_px`, its outline in the view of a camera that has this `calibration`: thousands of
    percepts are kept.
    """

    stamp_ns: int
    bearing_rad: float
    range_m: float
    outline: bytes = b""
    calibration: Calibration | None = None
    label: str = ""
    object: str = ""

    @property
    def outline_px(self) -> list[tuple[int, int]]:
        """Return the corners of its outline, column and row each."""
        return _CORNERS.decode(self.outline) if self.outline else []


_CORNERS = msgspec.msgpack.Decoder(list[tuple[int, int]])

MAX_SIGHTS = 16_384
"""Percepts that are kept: of some quarter of an hour. Of a longer drive the last ones count."""
MAX_POSES = 65_536
"""True poses that are kept: 54 minutes at twenty a second, and of a longer drive fewer a second."""
MAX_OLDER_SIGHTS = MAX_SIGHTS // 4
"""Older ones that may wait to be forgotten together."""


class PerceptTally:
    """Follows percepts, deltas and true poses. `seen` has all that was perceived, but for places to
    charge at; `entered` has the percepts that came into the agent's graph, with what they were
    given to: of both the last MAX_SIGHTS at least. `true` is the robot's path. A view's percepts
    and their delta are from two processes: either may arrive first.

    A percept is given to an object by its INSTANCE link, also by one that comes later. One without
    a link is given to the object that is made of it: the one of its label that enters the map in
    its cycle.
    """

    def __init__(self) -> None:
        self.seen: list[Sight] = []
        self.true = Track(MAX_POSES)
        self._entered: list[Sight] = []
        self._newest: dict[str, Sight] = {}
        self._known: set[str] = set()
        self._perceived: dict[tuple[int, float, float], Sight] = {}
        self._calibration: Calibration | None = None

    @property
    def entered(self) -> list[Sight]:
        """Return the percepts that came into the agent's graph, each with its outline, if that was
        perceived.
        """
        found = []
        for sight in self._entered:
            key = (sight.stamp_ns, sight.bearing_rad, sight.range_m)
            perceived = self._perceived.get(key, sight)
            outlined = replace(sight, outline=perceived.outline, calibration=perceived.calibration)
            found.append(outlined)

        return found

    def update(self, message: Message) -> None:
        """Take account of one message; one of another kind is ignored."""
        match message:
            case TruePose():
                pose = message.pose
                self.true.add(message.stamp_ns, pose.x_m, pose.y_m, pose.heading_rad)
            case Percepts():
                self._on_percepts(message)
            case Delta():
                self._on_delta(message)

    def _on_percepts(self, percepts: Percepts) -> None:
        if percepts.calibration != self._calibration:
            self._calibration = percepts.calibration
        for percept in percepts.objects:
            if percept.function not in SATISFIED_BY.values():
                key = (percepts.stamp_ns, percept.bearing_rad, percept.range_m)
                outline = msgspec.msgpack.encode(percept.outline_px)
                sight = Sight(*key, outline, self._calibration)
                self._perceived[key] = sight
                self.seen.append(sight)

        if len(self.seen) > MAX_SIGHTS + MAX_OLDER_SIGHTS:
            self._forget(self.seen[-MAX_SIGHTS].stamp_ns)

    def _forget(self, until_ns: int) -> None:
        """Forget what is older."""
        self.seen = [each for each in self.seen if each.stamp_ns >= until_ns]
        self._entered = [each for each in self._entered if each.stamp_ns >= until_ns]
        self._perceived = {key: each for key, each in self._perceived.items() if key[0] >= until_ns}

    def _on_delta(self, delta: Delta) -> None:
        made = []
        for operation in delta.operations:
            match operation:
                case Percept():
                    self._on_percept(operation, delta.stamp_ns)
                case Object() if operation.id not in self._known:
                    self._known.add(operation.id)
                    made.append(operation)
                case Link(kind=LinkKind.INSTANCE):
                    self._give(operation.source, operation.target)
                case Links(kind=LinkKind.INSTANCE):
                    for source, weights in operation.weights.items():
                        for target in weights:
                            self._give(source, target)
                case DropNode():
                    self._newest.pop(operation.id, None)

        # Those of a map that is recalled are made of no percept.
        if delta.phase is Phase.OBJECTS:
            for node in made:
                self._give_maker(node, delta.stamp_ns)

    def _on_percept(self, node: Percept, stamp_ns: int) -> None:
        sight = Sight(stamp_ns, node.bearing_rad, node.range_m, label=node.label)
        before = self._newest.get(node.id)
        if before is not None and replace(before, object="") == sight:
            return

        self._newest[node.id] = sight
        self._entered.append(sight)

    def _give(self, percept: str, target: str) -> None:
        sight = self._newest.get(percept)
        if sight is not None:
            sight.object = target

    def _give_maker(self, node: Object, stamp_ns: int) -> None:
        """Give the object that was just made the percept that it was made of."""
        for sight in self._newest.values():
            if sight.stamp_ns == stamp_ns and sight.label == node.label and not sight.object:
                sight.object = node.id

    def true_poses(self, sights: Sequence[Sight]) -> Floats:
        """Return the true poses that (n,) sights were seen from, (n, 3), in the world's frame; NaN
        where they are unknown.
        """
        stamps_ns = np.array([sight.stamp_ns for sight in sights], np.int64)
        if not len(self.true) or not len(stamps_ns):
            return np.full((len(stamps_ns), 3), np.nan)

        is_known = self.true.covers(stamps_ns)
        return np.where(is_known[:, None], self.true.at(stamps_ns), np.nan)
