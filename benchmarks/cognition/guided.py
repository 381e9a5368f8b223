"""Routes that an agent drives once with a map, and again by what it learned of guidance alone.

Percept-level sensing, the modules on the in-memory bus. On the first drive the agent gets the
route as a row of goals, the next one once it takes itself to be near the one before. The second
begins at the same place, with an empty map, no goal, and no schemes but those that were learned.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.explore.drivable import Drivable
from benchmarks.explore.trials import Point, draw_goal
from benchmarks.harness import COGNITION, TownObserver, build, running, town_sections
from benchmarks.report import Metrics
from cogmap.cli.progress import bar
from cogmap.geometry.polylines import nearest_on_line, resample
from cogmap.parallel import parallel_map
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Behaviours, GuidanceScheme
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import NEVER_NS, Goal, goal_id
from cogmap.schemas.sensing import TruePose, TrueTown
from cogmap.services.procedural.public import toml

ROUTES = 10
FIRST_SEED = 301
MIN_ROUTE_M = 100.0
GOAL_EVERY_M = 15.0
NEXT_WITHIN_M = 6.0
TAUGHT_WITHIN_M = 4.0
GUIDED_WITHIN_M = 5.0
SLOWEST_M_S = 0.5
STOOD_S = 15.0
MOVED_M = 0.1


@dataclass(frozen=True)
class Route:
    """The result of a route of `length_m`: how far the agent was from its end after each of the
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
        """Return whether the first drive came to the end."""
        return self.taught_away_m <= TAUGHT_WITHIN_M

    @property
    def is_guided(self) -> bool:
        """Return whether both drives came to the end, the second without running into anything."""
        return self.is_taught and self.away_m <= GUIDED_WITHIN_M and not self.collisions


class Driven:
    """Follows where a robot is in truth, until it has stood for STOOD_S."""

    def __init__(self) -> None:
        self.path_m: list[Point] = []
        self.collisions = 0
        self.max_s = math.inf
        self.now_s = 0.0
        self._moved_s = 0.0

    def on_pose(self, pose: TruePose) -> None:
        """Take the robot's pose."""
        here_m = (pose.pose.x_m, pose.pose.y_m)
        self.now_s = pose.stamp_ns / 1e9
        self.collisions = pose.collisions
        if not self.path_m or math.dist(here_m, self.path_m[-1]) > MOVED_M:
            self.path_m.append(here_m)
            self._moved_s = self.now_s

    @property
    def is_over(self) -> bool:
        """Return whether it stands for good, or is late."""
        return self.now_s - self._moved_s >= STOOD_S or self.now_s >= self.max_s


class Teacher(TownObserver):
    """Draws a route, gives the agent its goals, and keeps the schemes that it learns."""

    def __init__(self, seed: int) -> None:
        super().__init__()
        self.driven = Driven()
        self.route_m = np.empty((0, 2))
        self.learned: dict[str, GuidanceScheme] = {}
        self._rng = np.random.default_rng([seed, 0x60])
        self._goals: list[Goal] = []
        self._offered = 0

    def on_behaviours(self, behaviours: Behaviours) -> None:
        """Keep what the agent has learned."""
        self.learned |= {scheme.name: scheme for scheme in behaviours.learned}

    def act(self, true: TruePose) -> list[Message]:
        """Offer the next goal once the agent takes itself to be near the one before."""
        self.driven.on_pose(true)
        if not self._goals and self.town is not None:
            self._goals = self._draw(self.town, true)
        elif not self._is_near():
            return []

        operations: list[Operation] = [self._goals[self._offered]]
        if self._offered:
            operations.append(DropNode(id=self._goals[self._offered - 1].id))
        self._offered += 1
        return [Offer(cycle=self.graph.cycle, operations=operations)]

    def _draw(self, town: TrueTown, true: TruePose) -> list[Goal]:
        """Draw a route from where the robot begins, and return its goals."""
        here_m = (true.pose.x_m, true.pose.y_m)
        drivable = Drivable.of(town)
        length_m = 0.0
        while length_m < MIN_ROUTE_M:
            goal_m, length_m = draw_goal(self._rng, town, drivable, here_m)

        self.route_m = drivable.route_m(here_m, goal_m)
        self.driven.max_s = STOOD_S + length_m / SLOWEST_M_S
        goals_m = np.vstack([resample(self.route_m, GOAL_EVERY_M)[1:], self.route_m[-1:]])
        goals = []
        for number, (x_m, y_m) in enumerate(self.to_map(goals_m).tolist()):
            goals.append(Goal(id=goal_id(str(number)), base_level=1.0, x_m=x_m, y_m=y_m))

        return goals

    def _is_near(self) -> bool:
        """Decide whether the agent believes it is near the last goal offered, and more are left."""
        agent = self.graph.agent
        if agent is None or not 0 < self._offered < len(self._goals):
            return False

        goal = self.graph.get(Goal, self._goals[self._offered - 1].id)
        if goal is None:
            return False
        away_m = math.hypot(goal.x_m - agent.x_m, goal.y_m - agent.y_m)
        return away_m <= NEXT_WITHIN_M or goal.reached_ns != NEVER_NS


def drive_twice(seed: int) -> Route:
    """Drive a route in the town of a seed twice. Raises CogmapError if a module rejected a
    message.
    """
    # A town, and an agent that does not explore.
    sections = town_sections(seed) | {"planning": {"explore": False}}
    teacher = Teacher(seed)
    teaching = teacher.module("teacher", [topics.OFFER])
    teaching.on(topics.BEHAVIOURS, teacher.on_behaviours)

    taught = teacher.driven
    with running([*build(("sim", *COGNITION), sections), teaching]) as runner:
        runner.run(lambda: taught.is_over)
    end_m = teacher.route_m[-1]

    guided = Driven()
    guided.max_s = 2 * taught.now_s + STOOD_S
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "schemes.toml"
        file.write_text(toml.written(teacher.learned.values()))
        sections["procedural"] = {"schemes": str(file)}
        observer = Module("observer").on(topics.TRUE_POSE, guided.on_pose)
        with running([*build(("sim", *COGNITION), sections), observer]) as runner:
            runner.run(lambda: guided.is_over)

    # The mean distance of the second drive from the path of the first.
    driven_m = np.array(guided.path_m)
    feet_m = nearest_on_line(np.array(taught.path_m), driven_m).foot_m
    beside_m = float(np.hypot(*(driven_m - feet_m).T).mean())
    return Route(
        length_m=float(np.hypot(*np.diff(teacher.route_m, axis=0).T).sum()),
        taught_away_m=math.dist(taught.path_m[-1], end_m),
        away_m=math.dist(guided.path_m[-1], end_m),
        taught_collisions=taught.collisions,
        collisions=guided.collisions,
        schemes=len(teacher.learned),
        beside_m=beside_m,
    )


def guidance(processes: int) -> Metrics:
    """Measure the share of routes whose end the agent reaches by guidance schemes alone, within
    GUIDED_WITHIN_M and without running into anything, and further figures of the routes.
    """
    seeds = list(range(FIRST_SEED, FIRST_SEED + ROUTES))
    with bar("guided routes") as progress:
        driven = parallel_map(drive_twice, seeds, processes, progress)

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
