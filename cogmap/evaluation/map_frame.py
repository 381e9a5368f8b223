"""The frame of the agent's map in that of its start: another one once a map was recalled. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.geometry import se2
from cogmap.geometry.arrays import Floats
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import ROOT_MAP, Map, Recollection

NOWHERE = np.zeros(3)


class MapFrame:
    """Follows deltas. The agent begins in a frame of its own; all that it knows moves into the
    frame of a map that it recalls. `recalled` is that map's name, empty before.
    """

    def __init__(self) -> None:
        self.recalled = ""
        self._offered = NOWHERE
        self._start = NOWHERE

    def update(self, delta: Delta) -> None:
        """Take account of one delta, before what it has of the agent."""
        for operation in delta.operations:
            match operation:
                case Recollection():
                    pose = (operation.x_m, operation.y_m, operation.heading_rad)
                    self._offered = np.array(pose)
                case Map(id=name, remembered=remembered) if name == ROOT_MAP:
                    if remembered and not self.recalled:
                        self.recalled = remembered
                        self._start = self._offered

    def from_start(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the map into the frame in which the agent began."""
        return se2.transform_to(self._start, points_m)

    def to_map(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the frame in which the agent began into the map's."""
        return se2.transform_from(self._start, points_m)

    def pose_from_start(self, pose: Floats) -> Floats:
        """Transform a pose (3,) of the map into the frame in which the agent began."""
        return se2.relative(self._start, pose)
