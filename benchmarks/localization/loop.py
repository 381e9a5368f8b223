"""The workspace's phases that localize, map and correct, and their codelets, without the rest of
the mind.
"""

from __future__ import annotations

import numpy as np

from benchmarks.localization.senses import Moment
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import object_id
from schemas.array import Array
from schemas.cognition import Task
from schemas.graph import Node, Operation, Proposal
from schemas.sensing import Percepts
from services.codelets.config import Config
from services.codelets.mapping.path import odometry_of, rows_of
from services.codelets.module import Worker
from services.workspace.commit import Ledger
from services.workspace.config import Config as WorkspaceConfig
from services.workspace.context import SELF, Scene
from services.workspace.loop_closure import correction_tasks, path_tasks, revisit_tasks, shift_tasks
from services.workspace.triggers import first_self, object_tasks, tasks_for

# A robot whose senses nobody has calibrated, among landmarks no thicker than a finger: its gains
# may be off by what sensory memory says of wheels and the paper of distances, and what it sees
# twice it sees in the same place.
SPEED = 0.1
TURN = 0.1
DRIFT = 0.05
SPACING_M = 0.3
CONFIG = Config(
    samples=1000,
    kept_samples=100,
    landmark_samples=1000,
    correlated_views=1.0,
    landmark_jitter_m=0.003,
    speed_gain_sd=SPEED,
    turn_gain_sd=TURN,
    drift_rad_per_m=DRIFT,
    range_gain_sd=0.03,
    correct="heading",
    path_spacing_m=SPACING_M,
    path_variance_per_m=SPEED**2,
    heading_variance_per_m=DRIFT**2,
    heading_variance_per_rad=TURN**2,
)
LOOPS = WorkspaceConfig(mode="lockstep", path_spacing_m=SPACING_M)
CERTAIN_M = 1e-3
KNOWN_WELL = 100
NAME = "worker"


class Mind:
    """Tasks as the workspace makes them, answers as its workers give them, commits as its ledger
    judges them.
    """

    def __init__(
        self, start: tuple[float, float, float], config: Config = CONFIG, seed: int = 0
    ) -> None:
        self._ledger = Ledger(1.0)
        self._worker = Worker(config, NAME)
        self._cycle = seed * 1_000_000
        self._surveyed = False
        first = first_self(config.samples)
        first.samples = Array.of(np.tile(np.array(start), (config.samples, 1)))
        self._ledger.commit(0, 0, "start", [first])

    def learn(self, landmarks: dict[str, tuple[float, float]], surveyed: bool) -> None:
        """Put landmarks on the map, which stay for good where they are if that was surveyed."""
        self._surveyed = surveyed
        spread = np.random.default_rng(0).normal(0.0, CERTAIN_M, (50, 2))
        nodes: list[Operation] = [
            Node(
                id=object_id(label),
                kind="object",
                activation=1.0,
                base_level=1.0,
                attributes={"label": label, "surveyed": surveyed, "sightings": KNOWN_WELL},
                samples=Array.of(spread + where),
            )
            for label, where in landmarks.items()
        ]
        self._ledger.commit(0, 0, "survey", nodes)

    def _scene(self, moment: Moment) -> Scene:
        nothing = Array.of(np.zeros((0, 2), np.float32))
        stamp_ns = round(moment.stamp_s * 1e9)
        percepts = Percepts(
            stamp_ns=stamp_ns, frame=self._cycle, objects=moment.percepts, road_m=nothing
        )
        return Scene(self._cycle, percepts, Array.of(moment.motions))

    def _answer(self, tasks: list[Task], phase: str) -> None:
        """Let the codelets work on `tasks`, and commit what holds."""
        proposals = []
        for task in tasks:
            task.worker = NAME
            said = self._worker.work(task) or []
            proposals += [item for item in said if isinstance(item, Proposal)]
        operations, names = self._ledger.judge(proposals)
        if len(names) < len(tasks):
            raise RuntimeError(
                f"{len(tasks) - len(names)} of {len(tasks)} answers do not hold: {proposals[0].failure}"
            )
        if operations:
            self._ledger.commit(tasks[0].stamp_ns, self._cycle, phase, operations, names)

    def live(self, moment: Moment) -> None:
        """One cycle: localization, then the landmarks in view; on a map that was not surveyed,
        loops close.
        """
        self.localize(moment)
        loops = (
            []
            if self._surveyed
            else correction_tasks(self._scene(moment), self._ledger.graph, LOOPS)
        )
        self.map(moment)
        self._answer(loops, "correction")
        self._answer(shift_tasks(self._scene(moment), self._ledger.graph), "shift")

    def localize(self, moment: Moment) -> None:
        """A new cycle: the self node moves, corrected by what is in view."""
        self._cycle += 1
        self._answer(
            tasks_for("localization", self._scene(moment), self._ledger.graph, SPACING_M),
            "localization",
        )

    def map(self, moment: Moment) -> None:
        """The landmarks in view, new or known, and the path."""
        scene = self._scene(moment)
        graph = self._ledger.graph
        again = [] if self._surveyed else revisit_tasks(scene, graph, LOOPS)
        self._answer(
            [*object_tasks(scene, graph), *path_tasks(scene, graph, SPACING_M), *again], "objects"
        )

    @property
    def path(self) -> Floats:
        """(n, 7) rows of the path as it is on the map now: stamp_s, pose, and path integration's."""
        return rows_of(self._ledger.graph.nodes.values())

    @property
    def odometry(self) -> Floats:
        """(3,): where path integration alone would have the agent."""
        return odometry_of(self._ledger.graph.nodes[SELF])

    @property
    def pose(self) -> tuple[float, float, float]:
        """The mean of the self's samples."""
        facts = self._ledger.graph.nodes[SELF].attributes
        return float(facts["x_m"]), float(facts["y_m"]), float(facts["heading_rad"])
