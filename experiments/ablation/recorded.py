"""Robots that others drove among posts with barcodes: MRCLAM sets, of which each robot makes its
own map.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cogmap.data.mrclam import read
from cogmap.errors import CogmapError
from cogmap.estimation.alignment import motion_onto
from cogmap.experiments import in_memory, reading
from cogmap.experiments.ablation.outcome import Outcome, carried
from cogmap.experiments.ablation.variants import Rules, with_variant
from cogmap.experiments.loop_closing.observer import rms_m
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import TruePose
from cogmap.services import registry
from cogmap.services.player import formats
from cogmap.services.player.config import Config

COGNITION = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
MODULES = ("player", *COGNITION)
NEVER_S = 1e9
MIN_PLACES = 3


@dataclass(frozen=True)
class RecordedDrive:
    """The log of one robot of a set."""

    folder: Path
    robot: int

    def drive(self, rules: Rules) -> Outcome:
        """Play it. The error is the root mean square over the places of the path on the map in the
        end, in m, once that is aligned with the truth, as that of path integration is.

        Self-motion is that of the wheels: there are no images. Raises CogmapError if a message was
        refused, or the truth of too few places is known.
        """
        configured = with_variant(self.sections(), rules)
        observer = Observer()
        modules = [registry.build(name, configured) for name in MODULES]
        in_memory.run([*modules, observer.module()])

        path, true_m = observer.path()
        error_m = aligned_error_m(path[:, reading.POSE][:, :2], true_m)
        fused_m = aligned_error_m(path[:, reading.ODOMETRY][:, :2], true_m)
        return carried(error_m, fused_m, fused_m)

    def sections(self) -> Sections:
        """Return the configuration of every module: what the recording asks for."""
        recording = f"mrclam:{self.folder}"
        asked = formats.opened(Config(recording=recording, robot=self.robot)).settings
        codelets = asked["codelets"] | {"sparse_after_s": NEVER_S}  # the whole path is evaluated

        return {
            **asked,
            "run": {"lockstep": True, "participants": dict.fromkeys(MODULES, 1)},
            "player": {"recording": recording, "robot": self.robot},
            "codelets": codelets,
        }


class Observer:
    """Follows the graph, and the truth where motion capture has it."""

    def __init__(self) -> None:
        self._graph = Graph()
        self._true_m: dict[int, tuple[float, float]] = {}

    def module(self) -> Module:
        """Build the module `observer`."""
        return Module("observer").following(self._graph).on(topics.TRUE_POSE, self.on_pose)

    def on_pose(self, true: TruePose) -> None:
        """Keep the true position by its stamp."""
        self._true_m[_microseconds(true.stamp_ns * 1e-9)] = (true.pose.x_m, true.pose.y_m)

    def path(self) -> tuple[Floats, Floats]:
        """Return the rows of the path's places where the truth is known, and that, (n, 2). Raises
        CogmapError if they are too few.
        """
        rows = reading.path_rows(self._graph)
        known = []
        true_m = []

        for number, stamp_s in enumerate(rows[:, reading.STAMP].tolist()):
            position_m = self._true_m.get(_microseconds(stamp_s))
            if position_m is not None:
                known.append(number)
                true_m.append(position_m)

        if len(known) < MIN_PLACES:
            raise CogmapError("the truth is known of too few places of the path")
        return rows[known], np.array(true_m)


def _microseconds(stamp_s: float) -> int:
    return round(stamp_s * 1e6)


def aligned_error_m(path_m: Floats, true_m: Floats) -> float:
    """Return the root mean square distance of a path (n, 2) from the truth, once aligned with
    it.
    """
    motion = motion_onto(path_m, true_m)
    return rms_m(transform_from(motion, path_m) - true_m)


def of_set(folder: Path) -> Sequence[RecordedDrive]:
    """Return the drives of a set's robots. Raises UsageError if a file is missing."""
    return [RecordedDrive(folder, robot.number) for robot in read(folder).robots]
