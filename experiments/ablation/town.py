"""The town: laps to goals of the agent's own planning, with self-motion as good as fused."""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np

from cogmap.errors import CogmapError
from cogmap.evaluation.paths import FOLLOWED, Paths
from cogmap.experiments import in_memory
from cogmap.experiments.ablation.outcome import Outcome
from cogmap.experiments.ablation.variants import Rules, with_variant
from cogmap.geometry.se2 import transform_from
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import Odometry, TruePose
from cogmap.services import registry
from cogmap.services.sim.config import ODOMETRY_HZ
from cogmap.services.sim.layout.town import generate
from cogmap.services.sim.odometry import FUSED, Noise, WheelOdometry

COGNITION = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
MODULES = ("sim", *COGNITION)
LAPS = 1.5
LIMIT_S = 180.0
"""Ours takes half as long."""

FRAME_HZ = 5
ARRIVED_M = 8.0
"""The width of a street."""

UNKNOWN_COST = 2.0
"""As `cogmap run` has it on laps: a lap leads along unknown streets too."""

READINGS = ODOMETRY_HZ // FRAME_HZ
WHEELS = msgspec.structs.replace(
    Noise(), speed=Noise().speed / READINGS**0.5, turn=Noise().turn / READINGS**0.5
)
"""The noise of the town's wheels over a view: each reading's factors err anew, drift adds up."""


@dataclass(frozen=True)
class TownDrive:
    """Laps round the town of a seed."""

    seed: int
    laps: float = LAPS
    limit_s: float = LIMIT_S

    def drive(self, rules: Rules) -> Outcome:
        """Drive them. The error is the mean distance of the estimate from the truth over the drive.

        The robot is lost unless it halts where its last goal is, with all of them reached in time.
        Raises CogmapError if a message was refused, or there is no estimate.
        """
        goals_m = generate(self.seed).goals(self.laps)
        configured = with_variant(self.sections(goals_m), rules)
        observer = Observer(self.seed)
        modules = [registry.build(name, configured) for name in MODULES]
        in_memory.run([*modules, observer.module()])

        errors = observer.paths.errors()
        if not len(errors.stamps_ns):
            raise CogmapError("the drive gave no estimate")

        # The simulation ends a drive early once the agent halts with every goal reached.
        is_early = errors.stamps_ns[-1] * 1e-9 < self.limit_s - 1
        start = generate(self.seed).start
        origin = np.array([start.x_m, start.y_m, start.heading_rad])
        end_m = transform_from(origin, np.array(goals_m[-1:]))[0]
        away_m = math.dist(errors.poses[-1, :2], end_m)

        return Outcome(
            error=float(errors.estimate_m.mean()),
            fused=float(errors.fused_m.mean()),
            wheels=float(errors.wheels_m.mean()),
            is_lost=not is_early or away_m > ARRIVED_M,
        )

    def sections(self, goals_m: list[tuple[float, float]]) -> Sections:
        """Return the configuration of every module, as for `cogmap run --config`."""
        goals = []
        for number, (x_m, y_m) in enumerate(goals_m, start=1):
            goals.append({"name": f"corner {number}", "x_m": x_m, "y_m": y_m})

        return {
            "run": {"lockstep": True, "participants": dict.fromkeys(MODULES, 1)},
            "sim": {
                "seed": self.seed,
                "sensing": "percepts",
                "noise": msgspec.to_builtins(FUSED),
                "frame_hz": FRAME_HZ,
                "duration_s": self.limit_s,
                "ends_at_goal": True,
            },
            "workspace": {"goals": goals, "in_order": True},
            "planning": {"explore": True, "unknown_cost": UNKNOWN_COST},
        }


class Observer:
    """Follows the paths of a drive. What the town's wheels would have measured of it, they do not
    publish at the level of percepts: it is drawn here, from the true motion.
    """

    def __init__(self, seed: int) -> None:
        self.paths = Paths()
        self._wheels = WheelOdometry(WHEELS, seed)
        self._before: TruePose | None = None

    def module(self) -> Module:
        """Build the module `observer`."""
        module = Module("observer")
        for topic in FOLLOWED:
            module.on(topic, self.paths.update)
        return module.on(topics.TRUE_POSE, self.on_pose)

    def on_pose(self, true: TruePose) -> None:
        """Follow the true pose, and the wheels."""
        self.paths.update(true)
        before = self._before
        if before is not None and true.stamp_ns > before.stamp_ns:
            dt_s = (true.stamp_ns - before.stamp_ns) * 1e-9
            motion = self._wheels.measure(before.pose, true.pose, dt_s)
            self.paths.update(
                Odometry(
                    stamp_ns=true.stamp_ns,
                    speed_m_s=motion.speed_m_s,
                    turn_rate_rad_s=motion.turn_rate_rad_s,
                    dt_s=dt_s,
                )
            )
        self._before = true
