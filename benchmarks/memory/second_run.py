"""A second run in a town that was learned: how soon its map is recalled, and whether another town's
is taken for it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import msgspec
import numpy as np

from benchmarks.explore.measure import COGNITION
from benchmarks.explore.measure import sections as explored
from benchmarks.report import Metrics
from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative
from cogmap.graph.graph import Graph
from cogmap.parallel import Progress, parallel_map
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.memory import Restored, Stored, StoredRecord
from cogmap.schemas.nodes import ROOT_MAP, Map
from cogmap.schemas.sensing import Pose, TruePose
from cogmap.services import registry

FIRST_SEED = 101
TOWNS = 10
LEARN_S = 300.0
FIRST_START = 0
SECOND_START = 1
SETTLE_S = 5.0
RIGHT_WITHIN_M = 2.0
RIGHT_WITHIN_RAD = 0.1
MEMORY = "memory"


@dataclass(frozen=True)
class Visit:
    """A drive in a town from one of its starts, with what is remembered. It ends after `lasts_s`,
    or SETTLE_S after a map was recalled.
    """

    seed: int
    start: int
    known: Sequence[StoredRecord]
    lasts_s: float


class Drive(NamedTuple):
    """What a visit came to: the way driven, the map recalled (empty: none), how far it had been
    driven by then, where the agent took itself to be at the end in the frame of its map, where it
    was in the town, where it began there, and all that was stored.
    """

    driven_m: float
    recalled: str
    recalled_m: float
    believed: Floats
    true: Floats
    began: Floats
    stored: list[StoredRecord]

    def error(self, frame: Floats) -> tuple[float, float]:
        """How far, in m and rad, the agent is from where it takes itself to be, the origin of its
        map being at the pose `frame` of the town.
        """
        x_m, y_m, turn_rad = relative(compose(frame, self.believed), self.true).tolist()
        return math.hypot(x_m, y_m), abs(turn_rad)


class Observer:
    """Follows a drive and its graph, and keeps what is stored."""

    def __init__(self, visit: Visit) -> None:
        self._visit = visit
        self._graph = Graph()
        self._records: dict[str, StoredRecord] = {}
        self._began: Floats | None = None
        self._true_at: dict[int, Floats] = {}
        self._now_ns = 0
        self._driven_m = 0.0
        self._recalled = ""
        self._recalled_m = math.nan
        self._recalled_ns = 0

    def modules(self) -> list[Module]:
        """What takes part in the drive: an observer, and a store of what is remembered."""
        observer = (
            Module("observer")
            .following(self._graph, self._on_delta)
            .on(topics.TRUE_POSE, self._on_true)
            .on(topics.STORED, self._on_stored)
        )
        restored = Restored(records=list(self._visit.known))
        store = Module("store").on_start(lambda: restored, {MEMORY: 1}, [topics.RESTORED])
        return [observer, store]

    @property
    def is_complete(self) -> bool:
        """Whether the drive is over."""
        ends_ns = self._visit.lasts_s * 1e9
        if self._recalled:
            ends_ns = min(ends_ns, self._recalled_ns + SETTLE_S * 1e9)
        return self._now_ns >= ends_ns

    def drive(self) -> Drive:
        """What the drive came to."""
        agent = self._graph.agent
        assert agent is not None
        assert self._began is not None
        return Drive(
            driven_m=self._driven_m,
            recalled=self._recalled,
            recalled_m=self._recalled_m,
            believed=np.array([agent.x_m, agent.y_m, agent.heading_rad]),
            true=self._true_at[agent.stamp_ns],
            began=self._began,
            stored=list(self._records.values()),
        )

    def _on_true(self, true: TruePose) -> None:
        self._now_ns = true.stamp_ns
        self._driven_m = true.travelled_m
        self._true_at[true.stamp_ns] = _as_array(true.pose)
        if self._began is None:
            self._began = _as_array(true.pose)

    def _on_stored(self, stored: Stored) -> None:
        for record in stored.records:
            self._records[record.key] = record
        for key in stored.forgotten:
            self._records.pop(key, None)

    def _on_delta(self, delta: Delta) -> None:
        if delta.phase is not Phase.CORRECTION or self._recalled:
            return

        root = self._graph.get(Map, ROOT_MAP)
        if root is not None and root.remembered:
            self._recalled = root.remembered
            self._recalled_m = self._driven_m
            self._recalled_ns = self._now_ns


def visit(chosen: Visit) -> Drive:
    """Drive through a town. Raises CogmapError where a module rejected a message."""
    configured = sections(chosen)
    observer = Observer(chosen)
    modules = [registry.build(name, configured) for name in ("sim", *COGNITION, MEMORY)]
    with InProcessRunner([*modules, *observer.modules()]) as runner:
        runner.run(lambda: observer.is_complete)
        for shell in runner.shells:
            if shell.intake.rejected:
                raise CogmapError(f"{shell.module.name} rejected {dict(shell.intake.rejected)}")

    return observer.drive()


def sections(chosen: Visit) -> Sections:
    """A robot that explores a town and remembers, in lockstep, with percept-level sensing."""
    configured = explored(chosen.seed)
    sim = configured["sim"]
    sim["start"] = chosen.start
    configured["run"]["participants"][MEMORY] = 1
    return configured


def measure(processes: int, progress: Progress = lambda share: None, towns: int = TOWNS) -> Metrics:
    """How far is driven before the map of the first run is recalled and right, over the first run's
    way; and how often one of the other towns' maps is recalled instead.

    A town whose map is not recalled, or wrongly, counts with the whole way of the second run.
    """
    seeds = list(range(FIRST_SEED, FIRST_SEED + towns))
    learning = [Visit(seed, FIRST_START, (), LEARN_S) for seed in seeds]
    first = parallel_map(visit, learning, processes, lambda share: progress(share / 3))

    later = []
    for number, seed in enumerate(seeds):
        later.append(Visit(seed, SECOND_START, named(first[number].stored, seed), LEARN_S))
        others = [named(first[other].stored, seeds[other]) for other in range(towns)]
        del others[number]
        strange = [record for records in others for record in records]
        later.append(Visit(seed, SECOND_START, strange, LEARN_S))

    drives = parallel_map(visit, later, processes, lambda share: progress((1 + 2 * share) / 3))
    own, strange_drives = drives[::2], drives[1::2]
    shares = []
    are_right = []
    for before, after in zip(first, own, strict=True):
        shares.append(share_of_way(before, after))
        are_right.append(is_right(before, after))

    return {
        "second_run_share": float(np.mean(shares)),
        "recalled_right_share": float(np.mean(are_right)),
        "wrong_recalls": float(sum(bool(drive.recalled) for drive in strange_drives)),
    }


def named(records: Sequence[StoredRecord], seed: int) -> list[StoredRecord]:
    """Records of one town, under a name that no other town's have."""
    return [msgspec.structs.replace(record, map=f"town-{seed}") for record in records]


def share_of_way(first: Drive, second: Drive) -> float:
    """The way driven before a first run's map is recalled and right, over that of the first run;
    the whole way of the second one where it is not.
    """
    way_m = second.recalled_m if is_right(first, second) else second.driven_m
    return way_m / first.driven_m


def is_right(first: Drive, second: Drive) -> bool:
    """Whether the first run's map was recalled, and the agent is where it takes itself to be."""
    if not second.recalled:
        return False

    error_m, error_rad = second.error(first.began)
    return error_m <= RIGHT_WITHIN_M and error_rad <= RIGHT_WITHIN_RAD


def _as_array(pose: Pose) -> Floats:
    return np.array([pose.x_m, pose.y_m, pose.heading_rad])
