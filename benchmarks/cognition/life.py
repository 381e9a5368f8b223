"""The life of an agent that explores a town on a battery, at the level of percepts."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.harness import agent_modules, build, running, town_sections
from cogmap.cli.launch.tally import EnergyTally
from cogmap.runtime.module import Module
from cogmap.schemas import topics

CAPACITY_S = 500.0
"""The time that a full battery lasts at rest: less than a life, so that to stand still is no way to
live.
"""


@dataclass(frozen=True)
class Life:
    """An agent's life in a town: its time, its lowest level of energy, and how often it was
    charged.
    """

    lived_s: float
    lowest: float
    charged: int

    @property
    def ran_out(self) -> bool:
        """Return whether it ended because there was no energy left."""
        return self.lowest <= 0.0


def live(
    seed: int, max_s: float, *, has_cameras: bool = False, acting: Module | None = None
) -> Life:
    """Explore the town of a seed with a battery that runs down, until it is empty or `max_s`
    are over; `acting` selects actions in the place of the module `action`.
    """
    configured = town_sections(seed, has_cameras)
    configured["sim"] |= {
        "battery": {"capacity_s": CAPACITY_S},
        "duration_s": max_s,
    }
    configured["run"] |= {"energy": True}

    modules = build(("sim", *agent_modules(has_cameras)), configured)
    if acting is not None:
        modules = [acting if module.name == acting.name else module for module in modules]

    tally = EnergyTally()

    def lived_s() -> float:
        return tally.newest.stamp_ns / 1e9 if tally.newest is not None else 0.0

    with running([*modules, Module("observer").on(topics.ENERGY, tally.update)]) as runner:
        runner.run(lambda: tally.is_out or lived_s() >= max_s)

    return Life(lived_s=lived_s(), lowest=tally.lowest, charged=tally.charged)
