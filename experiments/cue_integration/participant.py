"""The participant's will as a module: it goes where the first post stood by the map in its
workspace.
"""

from __future__ import annotations

from cogmap.errors import MessageError
from cogmap.experiments.cue_integration.geometry import REACH_M, Point, Pose, step
from cogmap.experiments.cue_integration.room import FOLLOW, STOP, WAIT, WALK
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import Action
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import Object, Percept, object_id

POSTS_CARRIED = 3
NEAR_M = 0.1
MAX_MOVEMENTS = 24
LOST_RAD = 0.8
LOOK_M = 0.25
MAX_LOOKS = 3
Choice = tuple[str, dict[str, Scalar]]


class Participant:
    """Follows until three posts are picked up, waits once, then walks to where it believes the
    first was, and puts it there as soon as that is within reach.

    It knows what is in the workspace and nothing else. While it does not know where it faces it
    takes a short step and looks.
    """

    def __init__(self) -> None:
        self._graph = Graph()
        self._carried: dict[str, Point] = {}
        self._movements = 0
        self._looks = 0
        self._has_waited = False
        self._has_stopped = False

    def on_delta(self, delta: Delta) -> Action | None:
        """Choose an action for each cycle that has ended. Raises MessageError if a delta is
        missing.
        """
        if not self._graph.apply(delta):
            raise MessageError(
                f"delta {delta.version} after version {self._graph.version}: a commit is missing"
            )
        if delta.phase is not Phase.END or self._has_stopped:
            return None

        agent = self._graph.agent
        if agent is None:
            raise MessageError("the graph has no self node")
        pose = Pose(agent.x_m, agent.y_m, agent.heading_rad)

        # A post is carried from now on, and it is kept in mind where it was: the map may not have
        # it.
        for node in self._graph.of_kind(Percept):
            if node.name.startswith("post-"):
                there = pose.after(node.bearing_rad, node.range_m)
                self._carried.setdefault(node.name, there.position)

        scheme, parameters = self._choose(pose, agent.heading_sd_rad)
        return Action(
            stamp_ns=delta.stamp_ns,
            cycle=delta.cycle,
            scheme=scheme,
            activation=1.0,
            parameters=parameters,
        )

    def _choose(self, pose: Pose, heading_sd_rad: float) -> Choice:
        """Choose the scheme of the next action, and its parameters."""
        if len(self._carried) < POSTS_CARRIED:
            return FOLLOW, {}
        if not self._has_waited:
            self._has_waited = True
            return WAIT, {}

        label, in_mind = next(iter(self._carried.items()))
        node = self._graph.get(Object, object_id(label))
        goal = in_mind if node is None else (node.x_m, node.y_m)
        bearing_rad, distance_m = pose.towards(goal)

        # As long as it does not know where it faces, it looks, so many times.
        is_lost = self._looks < MAX_LOOKS and heading_sd_rad > LOST_RAD
        is_within_reach = distance_m < REACH_M + NEAR_M
        if self._movements >= MAX_MOVEMENTS or (is_within_reach and not is_lost):
            self._has_stopped = True
            return STOP, _movement(bearing_rad, distance_m, bearing_rad, distance_m)

        self._movements += 1
        if is_lost:
            self._looks += 1
            return WALK, _movement(0.0, LOOK_M, bearing_rad, distance_m)

        turn_rad, forward_m = step(bearing_rad, distance_m)
        return WALK, _movement(turn_rad, forward_m, bearing_rad, distance_m)


def _movement(
    turn_rad: float, forward_m: float, goal_bearing_rad: float, goal_distance_m: float
) -> dict[str, Scalar]:
    """Return the parameters of a turn on the spot and a step straight on, and where the goal is
    believed to be before.
    """
    return {
        "turn_rad": turn_rad,
        "forward_m": forward_m,
        "goal_bearing_rad": goal_bearing_rad,
        "goal_distance_m": goal_distance_m,
    }


def build() -> Module:
    """Build the module `participant`."""
    participant = Participant()
    return Module("participant").on(topics.DELTA, participant.on_delta, emits=[topics.ACTION])
