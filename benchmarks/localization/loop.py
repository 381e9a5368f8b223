"""The workspace and a worker, as they drive the town, given a robot's self-motion and percepts."""

from __future__ import annotations

import time
from typing import cast

import numpy as np

from benchmarks.localization import nodes
from benchmarks.localization.senses import Moment
from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Handler, Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Proposal
from cogmap.schemas.graph import Delta
from cogmap.schemas.sensing import Percepts, SelfMotion
from cogmap.services import registry
from cogmap.services.codelets.localization import landmarks, localization

# A robot whose senses nobody has calibrated, among landmarks no thicker than a finger: its gains
# may err by what sensory memory takes for the wheels' noise and the paper for that of distances.
SPEED = 0.1
TURN = 0.1
DRIFT_RAD_PER_M = 0.05
RANGE = 0.03
SPACING_M = 0.3
SAMPLES = 1000
NEVER_S = 1e9
CYCLES_A_SEED = 1_000_000
LOCALIZATION = localization.CODELET.name
LANDMARK = landmarks.CODELET.name
LATE = " is late: "
"""How the workspace begins the reason for a late answer, after its name."""
Landmarks = dict[str, tuple[float, float]]


def sections(surveyed: bool) -> Sections:
    """The configuration of both modules; no loop is closed on a map that was surveyed."""
    codelets = {
        "samples": SAMPLES,
        "kept_samples": 100,
        "landmark_samples": 1000,
        "correlated_views": 1.0,
        "landmarks": "points",
        "landmark_jitter_m": 0.003,
        "speed_gain_sd": SPEED,
        "turn_gain_sd": TURN,
        "drift_rad_per_m": DRIFT_RAD_PER_M,
        "range_gain_sd": RANGE,
        "correct": "heading",
        "anchor": "map",
        "path_spacing_m": SPACING_M,
        "path_variance_per_m": SPEED**2,
        "heading_variance_per_m": DRIFT_RAD_PER_M**2,
        "heading_variance_per_rad": TURN**2,
        # The whole path is evaluated.
        "sparse_after_s": NEVER_S,
    }

    if surveyed:
        codelets["revisit_s"] = NEVER_S

    return {
        "run": {"lockstep": True},
        "workspace": {"base_level_decay": 0.0},
        "codelets": codelets,
    }


class LocalizationLoop:
    """Runs both modules on the in-memory bus, one cognitive cycle for each moment of a log.

    `task_s` has each task of the last cycle: its codelet, and the CPU time that the worker took.
    `late_answers` counts the answers of background codelets that came after what they would change
    had changed: the workspace rejects these in every drive.
    """

    def __init__(
        self,
        start: nodes.Pose,
        landmarks: Landmarks | None = None,
        surveyed: bool = False,
        seed: int = 0,
    ) -> None:
        self.task_s: list[tuple[str, float]] = []
        self._graph = Graph()
        self.late_answers = 0
        self._rejected: list[str] = []
        self._frame = 0
        self._until_ns = 0

        self._senses = Module("senses")
        self._senses.emits.update((topics.SELF_MOTION, topics.PERCEPTS))

        configured = sections(surveyed)
        first_cycle = seed * CYCLES_A_SEED
        initial = nodes.initial_map(start, landmarks or {}, surveyed, SAMPLES, first_cycle)
        workspace = registry.build("workspace", configured)
        if workspace.restore is not None:
            workspace.restore([initial])

        worker = self._worker(configured)
        observer = Module("observer").following(self._graph, self.count_rejected)
        self._runner = InProcessRunner([workspace, worker, observer, self._senses])

    def live(self, moment: Moment) -> None:
        """Run one cycle. Raises CogmapError if an answer was rejected that was not late."""
        self.task_s = []
        senses = self._runner.shells[-1]
        sensed = self._messages(moment)
        senses.publish(self._senses.stamp(sensed))
        self._runner.run()

        for shell in self._runner.shells:
            self._rejected += [str(reason) for reason in shell.intake.rejected]
        if self._rejected:
            raise CogmapError(f"the cycle at {moment.stamp_s} s lost answers: {self._rejected}")

    def close(self) -> None:
        """End the modules."""
        self._runner.close()

    @property
    def pose(self) -> Floats:
        """(3,): where the agent believes that it is."""
        return nodes.pose(self._graph)

    @property
    def odometry(self) -> Floats:
        """(3,): where path integration alone would have the agent."""
        return nodes.odometry(self._graph)

    @property
    def path(self) -> Floats:
        """(n, 11) rows of the path on the map now, see PathColumn."""
        return nodes.path(self._graph)

    def _worker(self, configured: Sections) -> Module:
        """The codelets' module, whose tasks are timed."""
        worker = registry.build("codelets", configured)
        for topic in (topics.TASK, topics.LEASES):  # it begins with whichever comes later
            worker.handlers[topic] = self._timed(worker.handlers[topic])
        return worker

    def _messages(self, moment: Moment) -> list[SelfMotion | Percepts]:
        """The next frame's self-motion and percepts."""
        stamp_ns = round(moment.stamp_s * 1e9)
        motion = SelfMotion(
            stamp_ns=stamp_ns,
            frame=self._frame,
            since_ns=self._until_ns,
            motions=Array.of(moment.motions),
        )
        percepts = Percepts(
            stamp_ns=stamp_ns,
            frame=self._frame,
            objects=moment.percepts,
            road_m=Array.of(np.zeros((0, 2), np.float32)),
        )
        self._frame += 1
        self._until_ns = stamp_ns
        return [motion, percepts]

    def count_rejected(self, delta: Delta) -> None:
        """Count the late answers that a delta names, and keep why others were rejected."""
        for reason in delta.reasons:
            if LATE in reason:
                self.late_answers += 1
            else:
                self._rejected.append(reason)

    def _timed(self, handler: Handler) -> Handler:
        def on_message(message: Message) -> list[Proposal]:
            began_s = time.process_time()
            proposals = cast(list[Proposal], handler(message))
            took_s = time.process_time() - began_s

            if proposals:
                self.task_s.append((proposals[0].codelet, took_s))
            return proposals

        return on_message
