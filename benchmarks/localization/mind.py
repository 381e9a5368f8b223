"""The workspace's localization and object phases and their codelets, without the rest of the mind."""

from __future__ import annotations

import numpy as np

from benchmarks.localization.senses import Moment
from bus.graph import object_id
from schemas.array import Array
from schemas.graph import Node, Operation, Proposal
from schemas.mind import Task
from schemas.sensing import Percepts
from services.codelets.module import Worker
from services.codelets.settings import Config
from services.workspace.commit import Ledger
from services.workspace.scene import SELF, Scene
from services.workspace.triggers import first_self, object_tasks, tasks_for

# A robot whose senses nobody has calibrated, among landmarks no thicker than a finger: its gains may be off by what
# sensory memory says of wheels and the paper of distances, and what it sees twice it sees in the same place.
CONFIG = Config(
    samples=1000,
    landmark_samples=1000,
    views_alike=1.0,
    landmark_jitter_m=0.003,
    speed_gain_sd=0.1,
    turn_gain_sd=0.1,
    drift_rad_per_m=0.05,
    range_gain_sd=0.03,
)
CERTAIN_M = 1e-3
KNOWN_WELL = 100
NAME = "worker"


class Mind:
    """Tasks as the workspace makes them, answers as its workers give them, commits as its ledger judges them."""

    def __init__(self, start: tuple[float, float, float], config: Config = CONFIG, seed: int = 0) -> None:
        self._ledger = Ledger(1.0)
        self._worker = Worker(config, NAME)
        self._cycle = seed * 1_000_000
        first = first_self(config.samples)
        first.samples = Array.of(np.tile(np.array(start), (config.samples, 1)))
        self._ledger.commit(0, 0, "start", [first])

    @property
    def graph_nodes(self) -> dict[str, Node]:
        """What is known, by name."""
        return self._ledger.graph.nodes

    def learn(self, landmarks: dict[str, tuple[float, float]], surveyed: bool) -> None:
        """Put landmarks on the map, which stay for good where they are if that was surveyed."""
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
        percepts = Percepts(stamp_ns=stamp_ns, frame=self._cycle, objects=moment.percepts, road_m=nothing)
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
            raise RuntimeError(f"{len(tasks) - len(names)} of {len(tasks)} answers do not hold: {proposals[0].failure}")
        self._ledger.commit(tasks[0].stamp_ns if tasks else 0, self._cycle, phase, operations, names)

    def live(self, moment: Moment) -> None:
        """One cycle: localization, then the landmarks in view."""
        self.localize(moment)
        self.map(moment)

    def localize(self, moment: Moment) -> None:
        """A new cycle: the self node moves, corrected by what is in view."""
        self._cycle += 1
        self._answer(tasks_for("localization", self._scene(moment), self._ledger.graph, 1.0), "localization")

    def map(self, moment: Moment) -> None:
        """The landmarks in view, new or known."""
        if moment.percepts:
            self._answer(object_tasks(self._scene(moment), self._ledger.graph), "objects")

    @property
    def pose(self) -> tuple[float, float, float]:
        """The mean of the self's samples."""
        facts = self._ledger.graph.nodes[SELF].attributes
        return float(facts["x_m"]), float(facts["y_m"]), float(facts["heading_rad"])

    @property
    def facts(self) -> dict[str, float | int | str | bool]:
        """What the self node says of itself."""
        return self._ledger.graph.nodes[SELF].attributes
