"""The motor program of guidance: a path as seen from where the agent was a moment ago. Pure."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import distances_along
from cogmap.geometry.se2 import move_with, transform_from
from cogmap.schemas.sensing import Pose, SpeedLimit
from cogmap.services.motor.aim import Aim
from cogmap.services.motor.config import Config
from cogmap.services.motor.parameters import Parameters, number, stamp
from cogmap.services.motor.route import Route, pursuit

# A bound on memory: 13 s at 5 views a second.
TRACKED_POSES = 64
# A shorter path counts as driven: procedural memory's THERE_M is as long.
SHORT_M = 2.0
# Distance from the end of a path at which it stops; chosen, not tuned.
END_M = 0.5
# Paths that differ more in direction lead elsewhere.
TURNED_RAD = 1.0


class Track:
    """The last TRACKED_POSES poses, by their stamps."""

    def __init__(self) -> None:
        self._poses: dict[int, Pose] = {}

    def put(self, stamp_ns: int, pose: Pose) -> None:
        """Note where the agent is at a time."""
        self._poses[stamp_ns] = pose
        while len(self._poses) > TRACKED_POSES:
            del self._poses[min(self._poses)]

    def at(self, stamp_ns: int) -> Pose | None:
        """Return the pose at a time; None if that is not known."""
        return self._poses.get(stamp_ns)


class Guide:
    """Drives through the places `ahead_1_m` and `left_1_m`, `ahead_2_m` and so on, of the pose at
    `seen_ns`, and stands at the last; if the path is shorter than SHORT_M it is there already.

    They are kept by path integration: by how the pose has changed since. If the pose then is not
    known, as after a restart, it is the first that is given.
    """

    def __init__(self, parameters: Parameters, config: Config, track: Track) -> None:
        self._seen_ns = stamp(parameters, "seen_ns")
        places_m: list[list[float]] = []
        while f"ahead_{len(places_m) + 1}_m" in parameters or len(places_m) < 2:
            each = len(places_m) + 1
            places_m.append([number(parameters, f"{name}_{each}_m") for name in ("ahead", "left")])

        self._places_m = np.array(places_m)
        self._config = config
        self._track = track
        self._before: Route | None = None
        self._route: Route | None = None
        self._is_short = distances_along(self._places_m)[-1] <= SHORT_M

    def continue_from(self, before: Guide) -> None:
        """Correct another program, by a share of what lies between their paths: what is seen is
        uncertain, and what was seen before counts too.
        """
        route = before._route or before._before
        if route is not None and route.left_m > END_M:
            self._before = route

    def aim(self, pose: Pose) -> Aim | SpeedLimit:
        """Aim at the point of the path that pure pursuit steers to, until the path ends."""
        if self._is_short:
            return SpeedLimit.NO_ACTION
        if self._route is None:
            self._route = self._route_at(pose)

        aim = pursuit(self._route, pose, self._config)
        return SpeedLimit.NO_ACTION if self._route.left_m <= END_M else aim

    def _route_at(self, pose: Pose) -> Route:
        """Make the path, as it is to be driven from a pose on."""
        seen = self._track.at(self._seen_ns) or pose
        frame = np.array([seen.x_m, seen.y_m, seen.heading_rad])
        places_m = transform_from(frame, self._places_m)
        route = Route(places_m)
        route.join(pose.x_m, pose.y_m)
        if self._before is None:
            return route

        self._before.advance(pose.x_m, pose.y_m)
        corrected = between(self._before.pose, route.pose, self._config.guided_share)
        self._before = None
        moved = Route(move_with(places_m, route.pose, corrected))
        moved.join(pose.x_m, pose.y_m)
        return moved


def between(before: Floats, now: Floats, share: float) -> Floats:
    """Move the pose `now`, (3,), aside and turn it towards `before`, so that `share` of what lies
    between them is left; return `now` itself if they lead elsewhere.
    """
    turn_rad = math.remainder(float(before[2] - now[2]), math.tau)
    if abs(turn_rad) > TURNED_RAD:
        return now

    left = np.array([-math.sin(now[2]), math.cos(now[2])])
    aside_m = float((before[:2] - now[:2]) @ left)
    position_m = now[:2] + (1 - share) * aside_m * left
    return np.append(position_m, now[2] + (1 - share) * turn_rad)
