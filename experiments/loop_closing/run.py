"""One loop, driven by the modules of the town on the in-memory bus."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from cogmap.experiments import in_memory, rendered
from cogmap.experiments.loop_closing.observer import Loop, Observer
from cogmap.parallel import Progress
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.services import registry
from cogmap.services.codelets.public import CodeletsConfig
from cogmap.services.codelets.rules import OURS, positions_rule, with_rules
from cogmap.services.sim.config import ODOMETRY_HZ
from cogmap.services.sim.odometry import Noise

COGNITION = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
MODULES = ("sim", *COGNITION)
SENSING = "percept-level sensing"
METHODS = ("positions", "heading")
CORNERS_M = (
    (0.0, 0.0),
    (180.0, 0.0),
    (180.0, 70.0),
    (260.0, 70.0),
    (260.0, 220.0),
    (0.0, 220.0),
    (0.0, 0.0),
)
AGAIN_M = (120.0, 0.0)
ASIDE_M = 14.0
APART_M = 60.0
CORNER_RAD = np.pi / 2
SPEED_M_S = 5.0
FRAME_HZ = 2
CELL_M = 3.0
# The wheels of the town's robot, read ten times between two views: each reading's factors err anew,
# drift adds up.
READINGS = ODOMETRY_HZ // FRAME_HZ
NOISE = Noise(speed=Noise().speed / READINGS**0.5, turn=Noise().turn / READINGS**0.5)


def trajectory() -> dict[str, Any]:
    """Return a line round some blocks and a bit of it again, and landmarks along the blocks, left
    and right in turn.
    """
    landmarks: list[dict[str, Any]] = []
    for start_m, end_m in itertools.pairwise(np.array(CORNERS_M)):
        street_m = end_m - start_m
        length_m = float(np.hypot(*street_m))
        ahead = street_m / length_m
        right = np.array([ahead[1], -ahead[0]])

        for along_m in np.arange(APART_M / 2, length_m, APART_M):
            number = len(landmarks)
            right_m = ASIDE_M if number % 2 else -ASIDE_M
            x_m, y_m = (start_m + along_m * ahead + right_m * right).tolist()
            landmarks.append({"name": f"building-{number:02d}", "x_m": x_m, "y_m": y_m})

    line_m = [*CORNERS_M, AGAIN_M]
    return {"line_m": line_m, "landmarks": landmarks, "speed_m_s": SPEED_M_S}


def sections(seed: int, method: str, rules: str = OURS) -> Sections:
    """Return the configuration of every module, as for `cogmap run --config`, for one of METHODS,
    by a preset of rules.
    """
    step_m = SPEED_M_S / FRAME_HZ
    sim = {
        "seed": seed,
        "noise": msgspec.structs.asdict(NOISE),
        "trajectory": trajectory(),
        "frame_hz": FRAME_HZ,
    }

    workspace = {"cell_m": CELL_M, "base_level_decay": 0.0}

    codelets = {
        "correct": positions_rule(rules) if method == "positions" else method,
        "path_spacing_m": step_m,
        "path_variance_per_m": NOISE.speed**2 * step_m,
        "heading_variance_per_m": NOISE.drift_rad_per_sqrt_m**2,
        "heading_variance_per_rad": NOISE.turn**2 * CORNER_RAD,
    }

    configured: Sections = {
        "run": {"lockstep": True, "participants": dict.fromkeys(MODULES, 1)},
        "sim": sim,
        "workspace": workspace,
        "codelets": codelets,
    }
    return with_rules(configured, rules)


def drive(seed: int, method: str, rules: str = OURS) -> Loop:
    """Drive the loop once. Raises CogmapError if no loop is closed, or a message is refused."""
    configured = sections(seed, method, rules)
    modules = [registry.build(name, configured) for name in MODULES]
    return driven(configured, modules)


def drive_by_cameras(seed: int, progress: Progress, rules: str = OURS) -> dict[str, Loop]:
    """Drive as `drive` does, by each of METHODS, with buildings that are drawn and recognised."""
    configured = {method: sections(seed, method, rules) for method in METHODS}
    return rendered.by_cameras(configured, COGNITION, driven, progress)


def driven(configured: Sections, modules: Sequence[Module]) -> Loop:
    """Drive as `drive` does, with these modules."""
    trajectory = configured["sim"]["trajectory"]
    places_m = {}

    for landmark in trajectory["landmarks"]:
        places_m[landmark["name"]] = (landmark["x_m"], landmark["y_m"])

    config = msgspec.convert(configured.get("codelets", {}), CodeletsConfig)
    observer = Observer(places_m, config)
    in_memory.run([*modules, observer.module()])
    return observer.loop()
