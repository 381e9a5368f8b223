"""Errands: several goals in a town of blocks that the agent does not know, in an order of its own.
What counts is the way that it drives, over the shortest past all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, permutations

import msgspec
import numpy as np

from cogmap.errors import CogmapError
from cogmap.evaluation.paths import FOLLOWED, Paths
from cogmap.experiments import in_memory
from cogmap.experiments.ablation.outcome import Outcome
from cogmap.experiments.ablation.town import MODULES, UNKNOWN_COST
from cogmap.experiments.ablation.variants import Rules, with_variant
from cogmap.experiments.city_maps.streets import Streets
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.services import registry
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.towns import BLOCKS, place
from cogmap.services.sim.odometry import FUSED

GOALS = 6
SIZE_M = 200.0
FRAME_HZ = 2
LIMIT_S = 600.0


@dataclass(frozen=True)
class Errands:
    """GOALS crossings of the town of blocks of a seed."""

    seed: int
    limit_s: float = LIMIT_S

    @cached_property
    def town(self) -> Place:
        """Make the town."""
        return place(BLOCKS, self.seed, SIZE_M)

    def drive(self, rules: Rules) -> Outcome:
        """Drive it. The result is the way driven over the shortest; NaN if the robot is lost, as
        not all goals were reached in time. Raises CogmapError if a message was refused.
        """
        goals_m, shortest_m = drawn(self.town)
        configured = with_variant(self.sections(goals_m), rules)
        paths = Paths()
        observer = Module("observer")
        for topic in FOLLOWED:
            observer.on(topic, paths.update)
        modules = [registry.build(name, configured) for name in MODULES]
        in_memory.run([*modules, observer])

        # The simulation ends a drive early once the agent halts with every goal reached.
        stamps_ns = paths.errors().stamps_ns
        if not len(stamps_ns):
            raise CogmapError("the drive gave no estimate")
        is_lost = stamps_ns[-1] * 1e-9 > self.limit_s - 1
        way = np.nan if is_lost else paths.travelled_m / shortest_m
        return Outcome(way, np.nan, np.nan, is_lost)

    def sections(self, goals_m: Floats) -> Sections:
        """Return the configuration of every module, as for `cogmap run --config`."""
        start = self.town.start
        origin = np.array([start.x_m, start.y_m, start.heading_rad])
        goals = []
        for number, (x_m, y_m) in enumerate(transform_to(origin, goals_m).tolist(), start=1):
            goals.append({"name": f"goal {number}", "x_m": x_m, "y_m": y_m})

        return {
            "run": {"lockstep": True, "participants": dict.fromkeys(MODULES, 1)},
            "sim": {
                "town": BLOCKS,
                "town_size_m": SIZE_M,
                "seed": self.seed,
                "sensing": "percepts",
                "noise": msgspec.to_builtins(FUSED),
                "frame_hz": FRAME_HZ,
                "duration_s": self.limit_s,
                "ends_at_goal": True,
            },
            "workspace": {"goals": goals},
            "planning": {"explore": True, "unknown_cost": UNKNOWN_COST},
        }


def drawn(town: Place) -> tuple[Floats, float]:
    """Draw (GOALS, 2) crossings of a town from its seed. Returns them, and the length of the
    shortest way past them all from the start, along the middles of the streets.
    """
    ends_m = np.array([(road.start, road.end) for road in town.roads]).reshape(-1, 2)
    points_m, numbers = np.unique(ends_m.round(1), axis=0, return_inverse=True)
    streets = Streets(points_m, numbers.reshape(-1, 2)).connected()

    meeting = np.bincount(streets.pieces.ravel())
    crossings = np.flatnonzero(meeting > 1)
    rng = np.random.default_rng([town.seed, GOALS])
    goals_m = streets.points_m[rng.choice(crossings, GOALS, replace=False)]

    start_m = np.array([(town.start.x_m, town.start.y_m)])
    network, stops = streets.with_points(np.vstack([start_m, goals_m]))
    distances_m, _ = network.shortest_paths(stops)
    between_m = distances_m[:, stops]
    lengths_m = []
    for order in permutations(range(1, GOALS + 1)):
        lengths_m.append(sum(between_m[a, b] for a, b in pairwise([0, *order])))

    return goals_m, float(min(lengths_m))
