"""How long an agent that explores a town keeps its energy, at the level of percepts."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.explore.measure import mind, sections
from cogmap.cli.launch.tally import EnergyTally
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import Energy
from cogmap.services import registry

CAPACITY_S = 500.0
"""How long a full battery lasts at rest: for less than a life, so that to stand still is no way to
live.
"""


@dataclass(frozen=True)
class Life:
    """How an agent fared in a town: for how long it lived, its lowest level of energy, and how
    often it was charged.
    """

    lived_s: float
    lowest: float
    charged: int

    @property
    def ran_out(self) -> bool:
        """Whether it ended for want of energy."""
        return self.lowest <= 0.0


class _Observer:
    def __init__(self) -> None:
        self.tally = EnergyTally()
        self.now_s = 0.0

    def on_energy(self, energy: Energy) -> None:
        self.tally.update(energy)
        self.now_s = energy.stamp_ns / 1e9


def live(
    seed: int, longest_s: float, *, has_cameras: bool = False, acting: Module | None = None
) -> Life:
    """Explore the town of a seed with a battery that runs down, until it is empty or `longest_s`
    are over; `acting` selects actions in the place of the module `action`.
    """
    configured = sections(seed, has_cameras)
    configured["sim"] = configured["sim"] | {
        "battery": {"capacity_s": CAPACITY_S},
        "duration_s": longest_s,
    }
    configured["run"] = configured["run"] | {"energy": True}

    observer = _Observer()
    watching = Module("observer").on(topics.ENERGY, observer.on_energy)
    modules = [registry.build(name, configured) for name in ("sim", *mind(has_cameras))]
    if acting is not None:
        modules = [acting if module.name == acting.name else module for module in modules]

    with InProcessRunner([*modules, watching]) as runner:
        runner.run(lambda: observer.tally.is_out or observer.now_s >= longest_s)

    return Life(
        lived_s=observer.now_s,
        lowest=observer.tally.lowest,
        charged=observer.tally.charged,
    )
