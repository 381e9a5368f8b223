"""What one trial is, and what came of it."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import msgspec
import numpy as np

from cogmap.experiments.cue_integration.geometry import CONFLICT_RAD, POSTS, ROUTES, Point, turned
from cogmap.services.codelets.rules import OURS


class Condition(enum.Enum):
    """What the participant may use on the way back (Nardini et al. 2008)."""

    SELF_MOTION = "self_motion"
    LANDMARKS = "landmark"
    BOTH = "both"
    CONFLICT = "conflict"


# The paper's error of a distance (§6.1), as a share. What is touched errs by no more.
DISTANCE = 0.03


class Noise(msgspec.Struct, frozen=True):
    """Standard deviations as shares of what is sensed: of speed, of turn rate, and of the distance
    to a landmark.

    Directions to landmarks err by as much across as distances do along; with `range_only` they are
    not sensed (paper, table 1). Disorientation takes away self-motion, the pose and the steps after
    it; with `felt` the pose alone.
    """

    speed: float
    turn: float
    landmark: float = DISTANCE
    range_only: bool = False
    felt: bool = False


@dataclass(frozen=True)
class Trial:
    """One trial of one condition, by a preset of rules. The same numbers give the same bytes."""

    condition: Condition
    number: int
    noise: Noise
    seed: int
    rules: str = OURS

    @property
    def route(self) -> tuple[int, int, int]:
        """Return the posts in the order in which they are picked up."""
        return ROUTES[self.number % len(ROUTES)]

    @property
    def side(self) -> int:
        """Return how landmarks turn in a conflict: 1 counter-clockwise, -1 clockwise."""
        rounds = self.number // len(ROUTES)
        is_even = rounds % 2 == 0
        return 1 if is_even else -1

    def generator_of_walk(self) -> np.random.Generator:
        """Return the world's own noise on the way to the posts, the same in all conditions."""
        return np.random.default_rng([self.seed, self.number])

    def generator_of_return(self) -> np.random.Generator:
        """Return the world's own noise on the way back."""
        condition = list(Condition).index(self.condition)
        return np.random.default_rng([self.seed, self.number, condition])

    @property
    def target(self) -> Point:
        """Return where the first post stood."""
        first, _, _ = self.route
        return POSTS[first]

    @property
    def turned_target(self) -> Point:
        """Return where it stood by landmarks turned as in a conflict."""
        (position,) = turned((self.target,), self.side * CONFLICT_RAD)
        return position


@dataclass(frozen=True)
class Response:
    """Where the participant put the first post back, in the room, after how many movements; and
    where it believed that place to be after its first look on the way back, which is the first step
    in the dark.
    """

    x_m: float
    y_m: float
    movements: int
    first_look: Point = (0.0, 0.0)

    @property
    def position(self) -> Point:
        """Return the position in the room."""
        return self.x_m, self.y_m
