"""One traversal: the modules that drive the town, on the in-memory bus, along a tour of a city."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from cogmap.experiments import in_memory
from cogmap.experiments.city_maps.correction import settings
from cogmap.experiments.city_maps.environment import Environment
from cogmap.experiments.city_maps.observer import Observer, Traversal
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.services import registry
from cogmap.services.codelets.rules import OURS
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.trajectory import Drawn

COGNITION = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
MODULES = ("sim", *COGNITION)
SENSING = "percept-level sensing"
VIEW: Drawn = "view"
LEG: Drawn = "leg"
SPEED_M_S = 5.0
FRAME_HZ = 1
LEAD_M = 70.0
OVERRUN_M = 100.0
CELL_M = 5.0
# A pedestrian in a city looks to the sides too, where a camera that is fixed looks ahead alone.
FIELD_OF_VIEW_RAD = math.pi


@dataclass(frozen=True)
class Tour:
    """A traversal of an environment: first building, direction, and the seed of its noise."""

    start: int
    backward: bool
    seed: int


def sections(
    environment: Environment,
    tour: Tour,
    noise: Noise,
    method: str,
    rules: str = OURS,
    *,
    drawn: Drawn = VIEW,
) -> Sections:
    """Return the configuration of every module for one traversal, as for `cogmap run --config`,
    with factors of noise `drawn` anew for each view, or for each leg of the tour.
    """
    correction = settings(method, SPEED_M_S / FRAME_HZ, rules)
    line_m = environment.line(tour.start, tour.backward, LEAD_M, OVERRUN_M)
    configured = senses(tour.seed, noise, FRAME_HZ)
    configured["sim"]["trajectory"] = {
        "line_m": line_m.tolist(),
        "landmarks": landmarks(environment),
        "speed_m_s": SPEED_M_S,
        "noise_drawn": drawn,
    }
    return {**configured, **correction}


def landmarks(environment: Environment) -> list[dict[str, str | float]]:
    """Return the buildings of an environment as landmarks of a configuration."""
    places_m = environment.buildings_m.tolist()
    return [
        {"name": name, "x_m": x_m, "y_m": y_m}
        for name, (x_m, y_m) in zip(environment.names, places_m, strict=True)
    ]


def senses(seed: int, noise: Noise, frame_hz: int) -> Sections:
    """Return how an agent senses a city, and how fine its map is, without where it is."""
    return {
        "run": {"lockstep": True, "participants": dict.fromkeys(MODULES, 1)},
        "sim": {
            "seed": seed,
            "noise": msgspec.structs.asdict(noise),
            "percepts": {"field_of_view_rad": FIELD_OF_VIEW_RAD},
            "frame_hz": frame_hz,
        },
        "workspace": {"cell_m": CELL_M, "base_level_decay": 0.0},
    }


def traverse(configured: Sections) -> Traversal:
    """Drive one tour to its end. Raises CogmapError if a message was lost or refused."""
    modules = [registry.build(name, configured) for name in MODULES]
    return driven(configured, modules)


def driven(configured: Sections, modules: Sequence[Module]) -> Traversal:
    """Drive as `traverse` does, with these modules."""
    trajectory = configured["sim"]["trajectory"]
    landmarks = trajectory["landmarks"]
    names = tuple(landmark["name"] for landmark in landmarks)

    # The pose at the beginning of the line, towards its second point.
    start_m, next_m = np.array(trajectory["line_m"][:2])
    dx_m, dy_m = next_m - start_m
    origin = np.append(start_m, math.atan2(dy_m, dx_m))

    observer = Observer(origin, names)
    in_memory.run([*modules, observer.module()])
    return observer.traversal()
