"""The room as a module: it moves the participant as asked, and publishes what the participant
senses of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cogmap.experiments import transcript
from cogmap.experiments.cue_integration import senses
from cogmap.experiments.cue_integration.geometry import (
    CONFLICT_RAD,
    LANDMARKS,
    POSTS,
    REACH_M,
    START,
    START_HEADING_RAD,
    Point,
    Pose,
    step,
    turned,
)
from cogmap.experiments.cue_integration.senses import Rows
from cogmap.experiments.cue_integration.trial import Condition, Response, Trial
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action
from cogmap.schemas.sensing import Percept, Percepts, SelfMotion

PERIOD_NS = 500_000_000
TOLERANCE_M = 1e-6
FOLLOW = "follow"
WAIT = "wait"
WALK = "walk"
STOP = "stop"
FIRST_LOOK = 2
NOTHING: Mapping[str, Point] = {}
AWAITS = {"workspace": 1, "codelets": 1, "participant": 1, transcript.NAME: 1}


class Room:
    """One trial's world. It knows where everything is, and publishes only what is sensed, with
    noise.
    """

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._rng = trial.generator_of_walk()
        self._pose = Pose(*START, START_HEADING_RAD)
        self._landmarks = LANDMARKS
        self._to_pick = list(trial.route)
        self._frame = 0
        self._are_lit = True
        self._feels_steps = True
        self._returned = 0
        self._first_look: Point | None = None
        self.response: Response | None = None

    def begin(self) -> list[Message]:
        """Return what is seen from the start."""
        percepts = self._seen(NOTHING)
        return self._sensed(senses.STANDING, percepts)

    def act(self, action: Action) -> list[Message]:
        """Carry out the participant's action; nothing more is sensed after the last."""
        if action.scheme == WAIT:
            return self._change()

        picked: Mapping[str, Point] = NOTHING
        if action.scheme == FOLLOW:
            # It walks to the post that is lit, and picks it up if it is within reach then.
            number = self._to_pick[0]
            post = POSTS[number]
            turn_rad, forward_m = step(*self._pose.towards(post))
            _, left_m = self._pose.after(turn_rad, forward_m).towards(post)
            if left_m <= REACH_M + TOLERANCE_M:
                self._to_pick.pop(0)
                picked = {f"post-{number}": post}
        else:
            turn_rad = float(action.parameters["turn_rad"])
            forward_m = float(action.parameters["forward_m"])
            self._returned += 1

        # The first of these actions was chosen with eyes closed.
        if self._returned == FIRST_LOOK and self._first_look is None:
            bearing_rad = float(action.parameters["goal_bearing_rad"])
            distance_m = float(action.parameters["goal_distance_m"])
            self._first_look = self._pose.after(bearing_rad, distance_m).position

        there = self._pose.after(turn_rad, forward_m)
        if action.scheme == STOP:
            first_look = self._first_look or there.position
            self.response = Response(there.x_m, there.y_m, self._frame, first_look)
            return []

        self._pose = there
        felt = senses.self_motion(turn_rad, forward_m, self._trial.noise, self._rng)
        motions = felt if self._feels_steps else senses.UNKNOWN
        return self._sensed(motions, self._seen(picked))

    def return_in(self, condition: Condition) -> None:
        """Have the room change as in another condition, if it has not changed yet."""
        self._trial = replace(self._trial, condition=condition)

    def close(self) -> None:
        """Leave whatever is open for the trial."""

    def _change(self) -> list[Message]:
        """Change the room, eyes closed, before the participant walks back."""
        condition = self._trial.condition
        self._rng = self._trial.generator_of_return()
        self._are_lit = condition is not Condition.SELF_MOTION

        if condition is Condition.CONFLICT:
            angle_rad = self._trial.side * CONFLICT_RAD
            self._landmarks = turned(LANDMARKS, angle_rad)

        if condition is not Condition.LANDMARKS:
            return self._sensed(senses.STANDING, [])

        self._feels_steps = self._trial.noise.felt
        heading_rad = float(self._rng.uniform(-math.pi, math.pi))
        self._pose = Pose(self._pose.x_m, self._pose.y_m, heading_rad)
        return self._sensed(senses.DISORIENTED, [])

    def _seen(self, picked: Mapping[str, Point]) -> list[Percept]:
        """Return the landmarks that are lit, and what is being picked up."""
        things: dict[str, Point] = {}

        if self._are_lit:
            for number, position in enumerate(self._landmarks):
                things[f"{senses.LANDMARK}{number}"] = position

        things |= picked
        return senses.sightings(self._pose, things, self._trial.noise, self._rng)

    def _sensed(self, motions: Rows, objects: list[Percept]) -> list[Message]:
        """Return the messages of the next frame."""
        frame = self._frame
        self._frame += 1
        stamp_ns = self._frame * PERIOD_NS

        self_motion = SelfMotion(
            stamp_ns=stamp_ns,
            frame=frame,
            since_ns=frame * PERIOD_NS,
            motions=Array.of(np.array(motions, np.float64)),
        )
        no_road = Array.of(np.zeros((0, 2), np.float32))
        percepts = Percepts(stamp_ns=stamp_ns, frame=frame, objects=objects, road_m=no_road)
        return [self_motion, percepts]


def build(room: Room) -> Module:
    """Build the module `room`, which begins when all whom it awaits are there."""
    emits = (topics.SELF_MOTION, topics.PERCEPTS)
    module = Module("room")
    module.on(topics.ACTION, room.act, emits=emits)
    module.on_start(room.begin, AWAITS, emits=emits)
    return module
