"""The workspace and a worker, as they drive the town, given a robot's self-motion and percepts."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import cast

import numpy as np

from benchmarks.localization.senses import Moment
from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Handler, Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Proposal
from cogmap.schemas.graph import Decay, Delta, Snapshot
from cogmap.schemas.nodes import (
    ROOT_MAP,
    SELF_ID,
    AnyNode,
    Map,
    Object,
    PathIntegration,
    PathSegment,
    Self,
    object_id,
)
from cogmap.schemas.sensing import Percepts, SelfMotion
from cogmap.services import registry
from cogmap.services.codelets.public import landmarks, localization

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
CERTAIN_M = 1e-3
LANDMARK_SAMPLES = 50
KNOWN_SIGHTINGS = 100
Pose = tuple[float, float, float]
LATE = " is late: "
"""The workspace puts it into the reason for a late answer, after the answer's name."""
Landmarks = dict[str, tuple[float, float]]


def sections(surveyed: bool, settings: Mapping[str, object]) -> Sections:
    """Configure both modules, the codelets with `settings` of a robot besides; no loop is closed on
    a map that was surveyed.
    """
    codelets: dict[str, object] = {
        "samples": SAMPLES,
        "kept_samples": 100,
        "landmark_samples": 1000,
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
    codelets |= settings

    if surveyed:
        codelets["revisit_s"] = NEVER_S

    return {
        "run": {"lockstep": True},
        "workspace": {"base_level_decay": 0.0},
        "codelets": codelets,
    }


def initial_map(start: Pose, landmarks: Landmarks, surveyed: bool, cycle: int) -> Snapshot:
    """Return a map with the agent at `start`, for certain, and `landmarks` by label at theirs.

    `surveyed` landmarks stay where they are for good. Codelets draw their samples by the number of
    the cycle, so runs that begin at another `cycle` have other noise.
    """
    x_m, y_m, heading_rad = start
    agent = Self(
        id=SELF_ID,
        activation=1.0,
        base_level=1.0,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        odometry=PathIntegration(x_m=x_m, y_m=y_m, heading_rad=heading_rad),
        samples=Matrix.of(np.tile(np.array(start), (SAMPLES, 1))),
    )
    nodes: list[AnyNode] = [Map(id=ROOT_MAP, cell_m=1.0), agent]
    offsets_m = np.random.default_rng(0).normal(0.0, CERTAIN_M, (LANDMARK_SAMPLES, 2))

    for label, (x_m, y_m) in landmarks.items():
        landmark = Object(
            id=object_id(label),
            activation=1.0,
            base_level=1.0,
            cycle=cycle,
            label=label,
            names={label: 1.0},
            x_m=x_m,
            y_m=y_m,
            surveyed=surveyed,
            sightings=KNOWN_SIGHTINGS,
            offsets_m=Matrix.of(offsets_m, "<f2"),
        )
        nodes.append(landmark)

    return Snapshot(version=1, cycle=cycle, decay=Decay(), nodes=nodes, links=[], tiles=[])


class LocalizationLoop:
    """Runs both modules on the in-memory bus, one cognitive cycle for each moment of a log.

    `task_s` has each task of the last cycle: its codelet, and the CPU time that the worker took.
    `late_answers` counts the answers of background codelets that came after what they would change
    had changed: the workspace rejects these in every drive. `settings` are those of the codelets in
    which the robot differs from MRCLAM's.
    """

    def __init__(
        self,
        start: Pose,
        landmarks: Landmarks | None = None,
        surveyed: bool = False,
        seed: int = 0,
        settings: Mapping[str, object] | None = None,
    ) -> None:
        self.task_s: list[tuple[str, float]] = []
        self._graph = Graph()
        self.late_answers = 0
        self._rejected: list[str] = []
        self._frame = 0
        self._until_ns = 0

        configured = sections(surveyed, settings or {})
        workspace = registry.build("workspace", configured)
        if workspace.restore is not None:
            first_cycle = seed * CYCLES_A_SEED
            workspace.restore([initial_map(start, landmarks or {}, surveyed, first_cycle)])

        worker = registry.build("codelets", configured)
        for topic in (topics.TASK, topics.LEASES):  # it begins with whichever comes later
            worker.handlers[topic] = self._timed(worker.handlers[topic])

        observer = Module("observer").following(self._graph, self.count_rejected)
        self._senses = Module("senses")
        self._senses.emits.update((topics.SELF_MOTION, topics.PERCEPTS))
        self._runner = InProcessRunner([workspace, worker, observer, self._senses])

    def live(self, moment: Moment) -> None:
        """Run one cycle. Raises CogmapError if an answer was rejected that was not late."""
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

        self.task_s = []
        self._runner.shells[-1].publish(self._senses.stamp([motion, percepts]))
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
        """Return the mean (3,) of the self's samples."""
        agent = self._agent
        return np.array([agent.x_m, agent.y_m, agent.heading_rad])

    @property
    def odometry(self) -> Floats:
        """Return the agent's pose (3,) by path integration alone."""
        return self._agent.odometry.pose()

    @property
    def individuals(self) -> int:
        """Return how many objects the map has that were seen more than once."""
        return sum(node.sightings > 1 for node in self._graph.of_kind(Object))

    @property
    def path(self) -> Floats:
        """Return (n, 11) rows of the path on the map now, see PathColumn."""
        return rows_of(self._graph.of_kind(PathSegment))

    @property
    def _agent(self) -> Self:
        if self._graph.agent is None:
            raise CogmapError("the graph has no self node")
        return self._graph.agent

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
