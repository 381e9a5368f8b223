"""A traversal whose robot obeys: the agent is given stops of the tour as goals, and drives to them
by its own attention, procedural memory, action selection and motor programs.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan2

import msgspec
import numpy as np

from cogmap.experiments import in_memory
from cogmap.experiments.city_maps.correction import settings
from cogmap.experiments.city_maps.drive import (
    FRAME_HZ,
    LEAD_M,
    MODULES,
    OVERRUN_M,
    SPEED_M_S,
    Tour,
    landmarks,
    senses,
)
from cogmap.experiments.city_maps.environment import Environment
from cogmap.experiments.city_maps.guide import REACHED_M, Guide, stops
from cogmap.experiments.city_maps.observer import Observer, Traversal
from cogmap.experiments.city_maps.streets import Points
from cogmap.geometry.polylines import distances_along
from cogmap.runtime.config import Sections
from cogmap.services import registry
from cogmap.services.codelets.rules import OURS
from cogmap.services.sim.odometry import Noise

GUIDE = "guide"
CRUISE_M_S = 4.0
"""The robot's own, of `motor.cruise_m_s`."""

VIEWS_HZ = 2
"""Views a second, as on errands through towns."""

MARGIN_M = 150.0
"""Streets around the tour that are there, too: an agent that takes a wrong turn drives on."""

CELL_M = 2.0
"""Between place nodes: four across a street."""

LIMIT_OVER_TOUR = 3.0
"""A drive ends after so many times as long as the tour takes at cruising speed."""


def sections(
    environment: Environment, tour: Tour, noise: Noise, method: str, rules: str = OURS
) -> Sections:
    """Return the configuration of every module for one traversal, and the guide's tour.

    A stretch of street errs as it does for an agent that is led: its views are nearer to each other
    than there, and their factors of noise so much larger.
    """
    view_m = SPEED_M_S / FRAME_HZ
    own_view_m = CRUISE_M_S / VIEWS_HZ
    more = (view_m / own_view_m) ** 0.5
    own_noise = msgspec.structs.replace(noise, speed=noise.speed * more, turn=noise.turn * more)

    line_m = environment.line(tour.start, tour.backward, LEAD_M, OVERRUN_M)
    dx_m, dy_m = line_m[1] - line_m[0]
    x_m, y_m = line_m[0].tolist()
    streets = {
        "pieces_m": _pieces_near(environment, line_m),
        "landmarks": landmarks(environment),
        "start": (x_m, y_m, atan2(dy_m, dx_m)),
    }
    limit_s = LIMIT_OVER_TOUR * float(distances_along(line_m)[-1]) / CRUISE_M_S
    configured = {
        **senses(tour.seed, own_noise, VIEWS_HZ),
        **settings(method, view_m, rules),
        GUIDE: {
            "line_m": line_m.tolist(),
            "buildings_m": environment.buildings_m.tolist(),
            "limit_s": limit_s,
        },
    }
    sim = {"sensing": "percepts", "streets": streets, "duration_s": 2 * limit_s}
    configured["sim"] = configured["sim"] | sim
    configured["workspace"] = configured["workspace"] | {"cell_m": CELL_M}
    configured["motor"] = {"cruise_m_s": CRUISE_M_S}
    planning = {"reached_m": REACHED_M}
    configured["planning"] = configured.get("planning", {}) | planning
    return configured


def traverse(configured: Sections) -> Traversal:
    """Drive one tour until its last stop is reached, or its time is up. Raises CogmapError if a
    message was lost or refused.
    """
    given = configured[GUIDE]
    modules_sections = {name: own for name, own in configured.items() if name != GUIDE}
    modules = [registry.build(name, modules_sections) for name in MODULES]

    streets = configured["sim"]["streets"]
    names = tuple(landmark["name"] for landmark in streets["landmarks"])
    observer = Observer(np.array(streets["start"]), names)
    tour = stops(np.array(given["line_m"]), np.array(given["buildings_m"]))
    guide = Guide(tour, given["limit_s"])

    in_memory.run([*modules, observer.module(), guide.module()], until=lambda: guide.is_over)
    return replace(observer.traversal(), outcome=guide.outcome())


def _pieces_near(environment: Environment, line_m: Points) -> list[list[float]]:
    """Return the pieces of streets, both ends each, that reach within MARGIN_M of the rectangle
    around a tour (n, 2).
    """
    streets = environment.streets
    ends_m = streets.points_m[streets.pieces]
    lower_m = line_m.min(axis=0) - MARGIN_M
    upper_m = line_m.max(axis=0) + MARGIN_M

    reaches_above = ends_m.max(axis=1) >= lower_m
    reaches_below = ends_m.min(axis=1) <= upper_m
    is_near = (reaches_above & reaches_below).all(axis=1)
    is_piece = np.hypot(*(ends_m[:, 1] - ends_m[:, 0]).T) > 0
    pieces: list[list[float]] = ends_m[is_near & is_piece].reshape(-1, 4).tolist()
    return pieces
