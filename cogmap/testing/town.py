"""A simulated town and its agent, in lockstep, in one process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import TracebackType
from typing import Any

import msgspec

from cogmap.errors import CogmapError
from cogmap.graph.graph import Graph
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import TruePose
from cogmap.schemas.topics import Topic
from cogmap.services import registry
from cogmap.services.sim.odometry import FUSED
from cogmap.testing.observer import Observer

COGNITION = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
"""The modules from percepts to motor commands, for which the simulation waits."""


class Town:
    """A town of blocks that an agent explores, sensed at the level of percepts.

    The same seed and settings give the same messages. `settings` are sections as of a configuration
    file, which come before the town's own. `modules` take part: one with the name of ours, such as
    `motor`, takes its place. `observe` are the topics that `observer` keeps besides the true poses.

        with Town(seed=3, settings={"trip": {"min_speed_m_s": 0.5}}) as town:
            town.run(seconds=10)
            assert town.graph.get(Node, "trip")
    """

    def __init__(
        self,
        seed: int = 1,
        settings: Mapping[str, Mapping[str, Any]] | None = None,
        modules: Iterable[Module] = (),
        observe: Iterable[Topic] = (),
    ) -> None:
        theirs = list(modules)
        taken = {module.name for module in theirs}
        configured = sections(seed, settings or {})
        ours = [
            registry.build(name, configured) for name in ("sim", *COGNITION) if name not in taken
        ]
        self.observer = Observer(topics.TRUE_POSE, *observe)
        self._runner = InProcessRunner([*ours, *theirs, self.observer.module])

    @property
    def graph(self) -> Graph:
        """Return the agent's graph as of now."""
        return self.observer.graph

    @property
    def true_poses(self) -> list[TruePose]:
        """Return where the robot was, in order; nobody but observers knows."""
        return self.observer.of(TruePose)

    def run(self, seconds: float) -> None:
        """Drive on for `seconds` of simulated time, or until the drive ends.

        Raises CogmapError if a module rejected a message, as it made no sense.
        """
        until_ns = self._now_ns() + seconds * 1e9
        self._runner.run(lambda: self._now_ns() >= until_ns)
        for shell in self._runner.shells:
            if shell.intake.rejected:
                raise CogmapError(f"{shell.module.name} rejected {dict(shell.intake.rejected)}")

    def close(self) -> None:
        """End every module."""
        self._runner.close()

    def __enter__(self) -> Town:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _now_ns(self) -> int:
        newest = self.observer.last(TruePose)
        return 0 if newest is None else newest.stamp_ns


def sections(seed: int, settings: Mapping[str, Mapping[str, Any]]) -> Sections:
    """Return the configuration of such a town, with `settings` in it."""
    configured: Sections = {
        "run": {"lockstep": True, "participants": dict.fromkeys(("sim", *COGNITION), 1)},
        "sim": {
            "seed": seed,
            "town": "blocks",
            "sensing": "percepts",
            "noise": msgspec.to_builtins(FUSED),
        },
        "planning": {"explore": True},
    }
    for section, values in settings.items():
        configured[section] = {**configured.get(section, {}), **values}
    return configured
