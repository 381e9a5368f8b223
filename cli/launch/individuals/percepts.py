"""Keeps the percepts of a drive, and which object of the map each was given to. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import interpolate
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, DropNode, Link, Links, Phase
from cogmap.schemas.nodes import SATISFIED_BY, LinkKind, Object, Percept
from cogmap.schemas.sensing import Calibration, Percepts, TruePose


@dataclass(slots=True)
class Sight:
    """A percept of the view of `stamp_ns`; `label` is what its node in the graph is called, and
    `object` the id of the node that it was given to, empty if it was given to none. `outline_px` is
    its outline in the view of a camera that has this `calibration`.
    """

    stamp_ns: int
    bearing_rad: float
    range_m: float
    outline_px: tuple[tuple[int, int], ...] = ()
    calibration: Calibration | None = None
    label: str = ""
    object: str = ""


MAX_SIGHTS = 32_768
"""Percepts that are kept: of some half an hour. Of a longer drive the last ones count."""
MAX_OLDER_SIGHTS = MAX_SIGHTS // 4
"""Older ones that may wait to be forgotten together."""


class PerceptTally:
    """Follows percepts, deltas and true poses. `seen` has all that was perceived, but for places to
    charge at; `entered` has the percepts that came into the agent's graph, with what they were
    given to: of both the last MAX_SIGHTS at least. `poses` are the true x_m, y_m and heading_rad by
    stamp. A view's percepts and their delta are from two processes: either may arrive first.

    A percept is given to an object by its INSTANCE link, also by one that comes later. One without
    a link is given to the object that is made of it: the one of its label that enters the map in
    its cycle.
    """

    def __init__(self) -> None:
        self.seen: list[Sight] = []
        self.poses: dict[int, tuple[float, float, float]] = {}
        self._entered: list[Sight] = []
        self._newest: dict[str, Sight] = {}
        self._known: set[str] = set()
        self._perceived: dict[tuple[int, float, float], Sight] = {}

    @property
    def entered(self) -> list[Sight]:
        """Return the percepts that came into the agent's graph, each with its outline, if that was
        perceived.
        """
        found = []
        for sight in self._entered:
            key = (sight.stamp_ns, sight.bearing_rad, sight.range_m)
            perceived = self._perceived.get(key, sight)
            outlined = replace(
                sight, outline_px=perceived.outline_px, calibration=perceived.calibration
            )
            found.append(outlined)

        return found

    def update(self, message: Message) -> None:
        """Take account of one message; one of another kind is ignored."""
        match message:
            case TruePose():
                pose = message.pose
                self.poses[message.stamp_ns] = (pose.x_m, pose.y_m, pose.heading_rad)
            case Percepts():
                for percept in message.objects:
                    if percept.function not in SATISFIED_BY.values():
                        key = (message.stamp_ns, percept.bearing_rad, percept.range_m)
                        sight = Sight(*key, tuple(percept.outline_px), message.calibration)
                        self._perceived[key] = sight
                        self.seen.append(sight)
                if len(self.seen) > MAX_SIGHTS + MAX_OLDER_SIGHTS:
                    self._forget(self.seen[-MAX_SIGHTS].stamp_ns)
            case Delta():
                self._on_delta(message)

    def _forget(self, until_ns: int) -> None:
        """Forget what is older."""
        self.seen = [each for each in self.seen if each.stamp_ns >= until_ns]
        self._entered = [each for each in self._entered if each.stamp_ns >= until_ns]
        self._perceived = {key: each for key, each in self._perceived.items() if key[0] >= until_ns}
        self.poses = {at_ns: pose for at_ns, pose in self.poses.items() if at_ns >= until_ns}

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
        stamps_ns = np.array(sorted(self.poses), np.int64)
        poses = np.array([self.poses[stamp_ns] for stamp_ns in stamps_ns.tolist()])
        wanted_ns = np.array([sight.stamp_ns for sight in sights], np.int64)
        if not len(poses) or not len(wanted_ns):
            return np.full((len(wanted_ns), 3), np.nan)

        since_s = (stamps_ns - stamps_ns[0]) / 1e9
        wanted_s = (wanted_ns - stamps_ns[0]) / 1e9
        poses[:, 2] = np.unwrap(poses[:, 2])
        known = interpolate(since_s, poses, wanted_s)

        is_known = (wanted_s >= 0) & (wanted_s <= since_s[-1])
        return np.where(is_known[:, None], known, np.nan)
