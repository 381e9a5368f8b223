"""Percept-level sensing: publishes what sensory memory and EPAM would publish, without images.

Nothing is rendered, so kilometres of driving take seconds. The errors are those that perception was
measured to make.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple, Protocol

import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Percept, Percepts, Pose, RangeScan, SelfMotion, TrueTown
from cogmap.services.sim.odometry import Motion
from cogmap.services.sim.percept_level.percepts import PerceptErrors
from cogmap.services.sim.percept_level.places import PlaceSim


class View(NamedTuple):
    """A range scan, (n,) each; points of the road and its boundary, (n, 2), in the robot's frame;
    and objects.
    """

    bearing_rad: Singles
    range_m: Singles
    road_m: Floats | Singles
    boundary_m: Singles
    objects: list[Percept]


class Sensors(Protocol):
    """Computes views of a place."""

    def look(self, pose: Pose) -> View:
        """Return what is seen from a pose."""

    def change(self, closed: Collection[str], gone: Collection[int]) -> None:
        """Let these streets be closed and these buildings be gone, and no others."""

    def town(self, closed: Collection[str], gone: Collection[int]) -> TrueTown:
        """Return the place as it is then."""


class PerceptSenses:
    """Publishes the views of `sensors`, with the self-motion since the last one."""

    def __init__(self, sensors: Sensors, errors: PerceptErrors, seed: int) -> None:
        self.change = sensors.change
        self.town = sensors.town
        self._sensors = sensors
        self._places = PlaceSim(errors, seed)
        self._motions: list[Motion] = []
        self._since_ns = 0

    def on_motion(self, motions: list[Motion], since_ns: int, stamp_ns: int) -> list[Message]:
        """Keep the self-motion of a tick: it is published with the view."""
        if not self._motions:
            self._since_ns = since_ns
        self._motions += motions
        return []

    def view(self, pose: Pose, stamp_ns: int, frame: int, energy: list[Message]) -> list[Message]:
        """Return self-motion since the last view, range scan, the energy, and percepts."""
        seen = self._sensors.look(pose)
        motions = np.array(self._motions).reshape(-1, 5)
        self._motions = []

        return [
            SelfMotion(
                stamp_ns=stamp_ns,
                frame=frame,
                since_ns=self._since_ns,
                motions=Array.of(motions, "<f8"),
            ),
            RangeScan(
                stamp_ns=stamp_ns,
                frame=frame,
                bearing_rad=Array.of(seen.bearing_rad),
                range_m=Array.of(seen.range_m),
            ),
            *energy,
            Percepts(
                stamp_ns=stamp_ns,
                frame=frame,
                objects=seen.objects,
                road_m=Array.of(seen.road_m, "<f4"),
                road_boundary_m=Array.of(seen.boundary_m),
                matches=self._places.recognize(frame, stamp_ns, pose),
            ),
        ]
