"""Routes that an agent drives once with a map, and again by what it learned of guidance alone.

Percept-level sensing, the modules on the in-memory bus. On the first drive the agent is told the
way as a row of goals, the next one once it takes itself to be near the one before. The second
begins at the same place, with an empty map, no goal, and no schemes but those that were learned.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.explore.drivable import Drivable
from benchmarks.explore.measure import COGNITION, sections
from benchmarks.explore.trials import Point, draw_goal
from benchmarks.report import Metrics
from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import nearest_on_line, resample
from cogmap.geometry.se2 import transform_to
from cogmap.graph.graph import Graph
from cogmap.parallel import parallel_map
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Behaviours, GuidanceScheme
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import NEVER_NS, Goal, goal_id
from cogmap.schemas.sensing import TruePose, TrueTown
from cogmap.services import registry
from cogmap.services.procedural.guidance.toml import written

ROUTES = 10
FIRST_SEED = 301
MIN_ROUTE_M = 100.0
TOLD_EVERY_M = 15.0
TOLD_WITHIN_M = 6.0
TAUGHT_WITHIN_M = 4.0
GUIDED_WITHIN_M = 5.0
SLOWEST_M_S = 0.5
STOOD_S = 15.0
MOVED_M = 0.1


@dataclass(frozen=True)
class Route:
    """What became of a route of `length_m`: how far the agent was from its end after each of the
    two drives, how often it ran into something on the first and on the second, how many schemes it
    learned, and how far it was from where it had driven before, on the mean.
    """

    length_m: float
    taught_away_m: float
    away_m: float
    taught_collisions: int
    collisions: int
    schemes: int
    beside_m: float

    @property
    def is_taught(self) -> bool:
        """Whether the first drive came to the end."""
        return self.taught_away_m <= TAUGHT_WITHIN_M

    @property
    def is_guided(self) -> bool:
        """Whether both drives did, the second without running into anything."""
        return self.is_taught and self.away_m <= GUIDED_WITHIN_M and not self.collisions


class Driven:
    """Follows where a robot is in truth, until it has stood for STOOD_S."""

    def __init__(self) -> None:
        self.path_m: list[Point] = []
        self.collisions = 0
        self.longest_s = math.inf
        self.now_s = 0.0
        self._moved_s = 0.0

    def on_pose(self, pose: TruePose) -> None:
        """Where it is now."""
        here_m = (pose.pose.x_m, pose.pose.y_m)
        self.now_s = pose.stamp_ns / 1e9
        self.collisions = pose.collisions
        if not self.path_m or math.dist(here_m, self.path_m[-1]) > MOVED_M:
            self.path_m.append(here_m)
            self._moved_s = self.now_s

    @property
    def is_over(self) -> bool:
        """Whether it stands for good, or is late."""
        return self.now_s - self._moved_s >= STOOD_S or self.now_s >= self.longest_s


class Teacher:
    """A module that draws a route, tells the agent the way, and keeps what that learns."""

    def __init__(self, seed: int) -> None:
        self.driven = Driven()
        self.graph = Graph()
        self.route_m = np.empty((0, 2))
        self.learned: dict[str, GuidanceScheme] = {}
        self._rng = np.random.default_rng([seed, 0x60])
        self._town: TrueTown | None = None
        self._goals: list[Goal] = []
        self._told = 0

    def module(self) -> Module:
        """The module to run beside the agent's."""
        return (
            Module("teacher")
            .following(self.graph)
            .on(topics.TRUE_TOWN, self.on_town)
            .on(topics.TRUE_POSE, self.on_pose, [topics.OFFER])
            .on(topics.BEHAVIOURS, self.on_behaviours)
        )

    def on_town(self, town: TrueTown) -> None:
        """The town as it was built."""
        self._town = town

    def on_behaviours(self, behaviours: Behaviours) -> None:
        """What the agent has learned."""
        self.learned |= {scheme.name: scheme for scheme in behaviours.learned}

    def on_pose(self, pose: TruePose) -> list[Message]:
        """Tell the agent where to go next, where it is to know that."""
        self.driven.on_pose(pose)
        if not self._goals and self._town is not None:
            self._draw(self._town, pose)
            return self._tell()

        return self._tell() if self._is_near() else []

    def _draw(self, town: TrueTown, pose: TruePose) -> None:
        """Draw a route from where the robot begins; its goals are in the frame of the map, which
        has its origin there.
        """
        start = np.array([pose.pose.x_m, pose.pose.y_m, pose.pose.heading_rad])
        here_m = (pose.pose.x_m, pose.pose.y_m)
        drivable = Drivable.of(town)
        length_m = 0.0
        while length_m < MIN_ROUTE_M:
            goal_m, length_m = draw_goal(self._rng, town, drivable, here_m)

        self.route_m = drivable.route_m(here_m, goal_m)
        self.driven.longest_s = STOOD_S + length_m / SLOWEST_M_S
        told_m = np.vstack([resample(self.route_m, TOLD_EVERY_M)[1:], self.route_m[-1:]])
        for number, (x_m, y_m) in enumerate(transform_to(start, told_m).tolist()):
            goal = Goal(id=goal_id(str(number)), base_level=1.0, x_m=x_m, y_m=y_m)
            self._goals.append(goal)

    def _is_near(self) -> bool:
        """Whether the agent takes itself to be near the goal that it was told last, of several."""
        agent = self.graph.agent
        if agent is None or not 0 < self._told < len(self._goals):
            return False

        goal = self.graph.get(Goal, self._goals[self._told - 1].id)
        if goal is None:
            return False
        away_m = math.hypot(goal.x_m - agent.x_m, goal.y_m - agent.y_m)
        return away_m <= TOLD_WITHIN_M or goal.reached_ns != NEVER_NS

    def _tell(self) -> list[Message]:
        operations: list[Operation] = [self._goals[self._told]]
        if self._told:
            operations.append(DropNode(id=self._goals[self._told - 1].id))
        self._told += 1
        return [Offer(cycle=self.graph.cycle, operations=operations)]


def drive_twice(seed: int) -> Route:
    """What becomes of a route in the town of a seed. Raises CogmapError where a module rejected a
    message.
    """
    teacher = Teacher(seed)
    taught = teacher.driven
    _run(_settings(seed), teacher.module(), taught)
    end_m = teacher.route_m[-1]

    guided = Driven()
    guided.longest_s = 2 * taught.now_s + STOOD_S
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "schemes.toml"
        file.write_text(written(teacher.learned.values()))
        observer = Module("observer").on(topics.TRUE_POSE, guided.on_pose)
        _run(
            _settings(seed) | {"procedural": {"schemes": str(file)}},
            observer,
            guided,
        )

    path_m = np.array(taught.path_m)
    driven_m = np.array(guided.path_m)
    return Route(
        length_m=float(np.hypot(*np.diff(teacher.route_m, axis=0).T).sum()),
        taught_away_m=math.dist(taught.path_m[-1], end_m),
        away_m=math.dist(guided.path_m[-1], end_m),
        taught_collisions=taught.collisions,
        collisions=guided.collisions,
        schemes=len(teacher.learned),
        beside_m=_mean_away_m(path_m, driven_m),
    )


def _mean_away_m(path_m: Floats, points_m: Floats) -> float:
    """The mean distance of (n, 2) points from a path (k, 2)."""
    feet_m = nearest_on_line(path_m, points_m).foot_m
    return float(np.hypot(*(points_m - feet_m).T).mean())


def _settings(seed: int) -> Sections:
    """A town, and an agent that does not explore."""
    return sections(seed) | {"planning": {"explore": False}}


def _run(configured: Sections, watching: Module, driven: Driven) -> None:
    modules = [registry.build(name, configured) for name in ("sim", *COGNITION)]
    with InProcessRunner([*modules, watching]) as runner:
        runner.run(lambda: driven.is_over)
        for shell in runner.shells:
            if shell.intake.rejected:
                raise CogmapError(f"{shell.module.name} rejected {dict(shell.intake.rejected)}")


def guidance(processes: int, routes: int = ROUTES) -> Metrics:
    """The share of routes whose end the agent comes to by guidance schemes alone, within
    GUIDED_WITHIN_M and without running into anything, and what else there is to know of them.
    """
    driven = parallel_map(drive_twice, list(range(FIRST_SEED, FIRST_SEED + routes)), processes)
    guided = [route for route in driven if route.is_guided]
    return {
        "guided_share": len(guided) / len(driven),
        "guided_taught_share": float(np.mean([route.is_taught for route in driven])),
        "guided_collisions": float(sum(route.collisions for route in driven)),
        "guided_away_m_max": max(route.away_m for route in driven),
        "guided_beside_m_mean": float(np.mean([route.beside_m for route in driven])),
        "guided_route_m_mean": float(np.mean([route.length_m for route in driven])),
        "guided_schemes_mean": float(np.mean([route.schemes for route in driven])),
    }
