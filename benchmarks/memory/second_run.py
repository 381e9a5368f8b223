"""A second run in a town that was learned: the distance until its map is recalled, and recalls of
another town's map.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import msgspec
import numpy as np

from benchmarks.harness import (
    COGNITION,
    TownObserver,
    build,
    pose_array,
    running,
    town_sections,
)
from benchmarks.report import Metrics
from cogmap.cli.progress import bar
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative
from cogmap.parallel import parallel_map
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.memory import Restored, Stored, StoredRecord
from cogmap.schemas.nodes import ROOT_MAP, Map
from cogmap.schemas.sensing import TruePose

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
    """A drive in a town from one of its starts, with the records remembered. It ends after
    `duration_s`, or SETTLE_S after a map was recalled.
    """

    seed: int
    start: int
    known: Sequence[StoredRecord]
    duration_s: float


class Drive(NamedTuple):
    """The result of a visit: the distance driven, the map recalled (empty: none), the distance
    driven by then, the pose that the agent believed in the end in the frame of its map, its true
    poses then and at the start in the town, and all that was stored.
    """

    driven_m: float
    recalled: str
    recalled_m: float
    believed: Floats
    true: Floats
    began: Floats
    stored: list[StoredRecord]

    def error(self, frame: Floats) -> tuple[float, float]:
        """Return the error, in m and rad, of the believed pose, if the origin of the agent's map is
        at the pose `frame` of the town.
        """
        x_m, y_m, turn_rad = relative(compose(frame, self.believed), self.true).tolist()
        return math.hypot(x_m, y_m), abs(turn_rad)


class DriveObserver(TownObserver):
    """Follows a drive and its graph, and keeps what is stored."""

    def __init__(self, visit: Visit) -> None:
        super().__init__()
        self._visit = visit
        self._records: dict[str, StoredRecord] = {}
        self._true_at: dict[int, Floats] = {}
        self._now_ns = 0
        self._driven_m = 0.0
        self._recalled = ""
        self._recalled_m = math.nan
        self._ends_ns = visit.duration_s * 1e9

    def act(self, true: TruePose) -> list[Message]:
        """Keep the pose."""
        self._now_ns = true.stamp_ns
        self._driven_m = true.travelled_m
        self._true_at[true.stamp_ns] = pose_array(true.pose)
        return []

    def on_stored(self, stored: Stored) -> None:
        """Keep what is remembered."""
        for record in stored.records:
            self._records[record.key] = record
        for key in stored.forgotten:
            self._records.pop(key, None)

    def on_delta(self, delta: Delta) -> None:
        """Note the first map that is recalled; a while later the drive is over."""
        if delta.phase is not Phase.CORRECTION or self._recalled:
            return

        root = self.graph.get(Map, ROOT_MAP)
        if root is not None and root.remembered:
            self._recalled = root.remembered
            self._recalled_m = self._driven_m
            self._ends_ns = min(self._ends_ns, self._now_ns + SETTLE_S * 1e9)

    @property
    def is_over(self) -> bool:
        """Return whether the drive has ended."""
        return self._now_ns >= self._ends_ns

    def drive(self) -> Drive:
        """Return the result of the drive."""
        agent = self.graph.agent
        assert agent is not None
        assert self.start is not None
        return Drive(
            driven_m=self._driven_m,
            recalled=self._recalled,
            recalled_m=self._recalled_m,
            believed=np.array([agent.x_m, agent.y_m, agent.heading_rad]),
            true=self._true_at[agent.stamp_ns],
            began=self.start,
            stored=list(self._records.values()),
        )


def visit(chosen: Visit) -> Drive:
    """Drive through a town. Raises CogmapError if a module rejected a message."""
    observer = DriveObserver(chosen)
    watching = observer.module("observer").on(topics.STORED, observer.on_stored)

    # It has what is remembered, in the place of the service that stores it.
    restored = Restored(records=list(chosen.known))
    store = Module("store").on_start(lambda: restored, {MEMORY: 1}, [topics.RESTORED])

    modules = build(("sim", *COGNITION, MEMORY), sections(chosen))
    with running([*modules, watching, store]) as runner:
        runner.run(lambda: observer.is_over)

    return observer.drive()


def sections(chosen: Visit) -> Sections:
    """Configure a robot that explores and remembers, in lockstep, with percept-level sensing."""
    configured = town_sections(chosen.seed)
    sim = configured["sim"]
    sim["start"] = chosen.start
    configured["run"]["participants"][MEMORY] = 1
    return configured


def measure(processes: int) -> Metrics:
    """Return the distance driven before the map of the first run is recalled and right, over the
    first run's; and how often one of the other towns' maps is recalled instead.

    A town whose map is not recalled, or wrongly, counts with the whole second run.
    """
    seeds = list(range(FIRST_SEED, FIRST_SEED + TOWNS))
    learning = [Visit(seed, FIRST_START, (), LEARN_S) for seed in seeds]
    with bar("first runs") as progress:
        first = parallel_map(visit, learning, processes, progress)

    later = []
    for number, seed in enumerate(seeds):
        later.append(Visit(seed, SECOND_START, named(first[number].stored, seed), LEARN_S))
        others = [named(first[other].stored, seeds[other]) for other in range(TOWNS)]
        del others[number]
        strange = [record for records in others for record in records]
        later.append(Visit(seed, SECOND_START, strange, LEARN_S))

    with bar("second runs") as progress:
        drives = parallel_map(visit, later, processes, progress)

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
    """Give the records of one town a name that no other town's have."""
    return [msgspec.structs.replace(record, map=f"town-{seed}") for record in records]


def share_of_way(first: Drive, second: Drive) -> float:
    """Return the distance driven before a first run's map is recalled and right, or else of the
    whole second run, over that of the first run.
    """
    way_m = second.recalled_m if is_right(first, second) else second.driven_m
    return way_m / first.driven_m


def is_right(first: Drive, second: Drive) -> bool:
    """Decide whether the first run's map was recalled, and the agent is where it believes it is."""
    if not second.recalled:
        return False

    error_m, error_rad = second.error(first.began)
    return error_m <= RIGHT_WITHIN_M and error_rad <= RIGHT_WITHIN_RAD
