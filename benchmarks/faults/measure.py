"""What kills of any process of a drive cost, and what they lose."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random

import click
import numpy as np

from benchmarks.benchmark import Setting
from benchmarks.faults.attack import Attacked, Kill, attack
from benchmarks.faults.cuts import recovered_share
from benchmarks.faults.judge import Lost, judged
from benchmarks.faults.parts import PARTS, key_of
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.cli.launch.watchdog import STALLED_S
from cogmap.cli.progress import bar
from cogmap.errors import CogmapError
from cogmap.parallel import Progress

KILLS = 200
SEED = 31
KILLS_A_DRIVE = 42
"""Each part three times: then another town."""

CUTS_A_LOG = 3
LIMIT_S = 3600.0
MAX_BACK_S = 3.0
KEYS = tuple(dict.fromkeys(key_of(part) for part in PARTS))

THRESHOLDS = {
    "lost_deltas": at_most(0),
    "lost_records": at_most(0),
    "wrong_graphs": at_most(0),
    "orphans": at_most(0),
    "stalled": at_most(0),
    "back_s_p95": at_most(MAX_BACK_S),
    "log_loss_s_max": at_most(0.5),
    "recovered_share": at_least(1),
    "unsaid": at_most(0),
}
PART_THRESHOLDS = {f"back_s_{key}_p95": at_most(MAX_BACK_S) for key in KEYS}
OPTIONS = (
    click.Option(
        ["--kills"],
        type=click.IntRange(1, 100_000),
        default=KILLS,
        show_default=True,
        help="How many, divided among the modes.",
    ),
    click.Option(
        ["--seed"],
        type=click.IntRange(0, 2**31),
        default=SEED,
        show_default=True,
        help="Of the towns, the order of the parts and the time before each kill.",
    ),
    click.Option(
        ["--only"],
        type=click.Choice(PARTS),
        multiple=True,
        help="Kill just this; repeatable.  [default: each in turn]",
    ),
    click.Option(
        ["--lockstep/--real-time", "is_lockstep"],
        default=None,
        help="Drive in that mode alone.  [default: both]",
    ),
    click.Option(
        ["--time-limit-s", "limit_s"],
        type=click.FloatRange(min=10),
        default=LIMIT_S,
        show_default=True,
        help="Begin no kill later, whatever is left.",
    ),
)


def measure(
    setting: Setting,
    *,
    kills: int = KILLS,
    seed: int = SEED,
    only: tuple[str, ...] = (),
    is_lockstep: bool | None = None,
    limit_s: float = LIMIT_S,
) -> Metrics:
    """Kill processes of real drives at random times, and count what that loses.

    Every process in turn is killed by `kill -9`, the fork server, the router and the recorder
    included, while an agent explores a small town: in lockstep at the level of percepts, in real
    time with cameras. A drive is attacked 42 times at most; then time stands, its graphs are
    compared, it ends, and its logs, journal and database are read. `back_s` is the longest wait for
    a motor command from a kill until five commands after the killed one is back; one of over 30 s
    has stalled the drive. Logs are cut at three random places each, and recovered. Takes about 20
    minutes; on a machine that is busy otherwise, times say nothing.
    """
    modes = [True, False] if is_lockstep is None else [is_lockstep]
    campaign = Campaign(setting.folder, only or PARTS, seed, time.monotonic() + limit_s)
    with bar("killing processes") as progress:
        for number, mode in enumerate(modes):
            wanted = (kills + number) // len(modes)
            began = campaign.kills
            until = campaign.kills + wanted
            while campaign.kills < until and campaign.has_time:
                campaign.drive(mode, until, lambda done: progress(done / kills))
                if campaign.kills == began:
                    raise CogmapError("a drive ended before anything was killed")

    return campaign.metrics()


class Campaign:
    """Drives one after another, whose files are in `folder`, until `limit_at_s` of the monotonic
    clock.
    """

    def __init__(self, folder: Path, parts: Sequence[str], seed: int, limit_at_s: float) -> None:
        self._folder = folder
        self._seed = seed
        self._parts = in_turn(parts, Random(seed))
        self._random = Random(seed)
        self._limit_at_s = limit_at_s
        self._drives: list[tuple[Attacked, Lost]] = []
        self._shares = [1.0]

    @property
    def kills(self) -> int:
        """Return how many there were."""
        return sum(len(attacked.kills) for attacked, _ in self._drives)

    @property
    def has_time(self) -> bool:
        """Return whether another kill may begin."""
        return time.monotonic() < self._limit_at_s

    def drive(self, is_lockstep: bool, until: int, progress: Progress) -> None:
        """Attack one drive, up to the kill numbered `until` of all, and look at what it lost."""
        before = self.kills

        def goes_on(attacked: Attacked) -> bool:
            here = len(attacked.kills)
            progress(before + here)
            return self.has_time and here < KILLS_A_DRIVE and before + here < until

        number = len(self._drives)
        folder = self._folder / f"drive-{number}"
        attacked = attack(folder, self._parts, self._seed + number, is_lockstep, goes_on)
        self._drives.append((attacked, judged(attacked)))
        for path in attacked.logs:
            self._shares.append(recovered_share(path, CUTS_A_LOG, self._random, folder))

    def metrics(self) -> Metrics:
        """Return the metrics of all drives together."""
        drives = [attacked for attacked, _ in self._drives]
        losses = [lost for _, lost in self._drives]
        kills = [kill for attacked in drives for kill in attacked.kills]
        stalled = [kill for kill in kills if math.isinf(kill.back_s)]

        lost_graph = sum(lost.lost_deltas_graph for lost in losses)
        lost_log = sum(lost.lost_deltas_log for lost in losses)
        metrics = {
            "lost_deltas": lost_graph + lost_log,
            "lost_records": sum(lost.lost_records for lost in losses),
            "wrong_graphs": sum(lost.wrong_graphs for lost in losses),
            "orphans": sum(attacked.orphans for attacked in drives),
            "stalled": len(stalled),
            "back_s_p95": p95_s(kills),
            "log_loss_s_max": max(lost.log_loss_s for lost in losses),
            "recovered_share": min(self._shares),
            "unsaid": sum(lost.unsaid for lost in losses),
        }
        for key in KEYS:
            of_part = [kill for kill in kills if key_of(kill.part) == key]
            if of_part:
                metrics[f"back_s_{key}_p95"] = p95_s(of_part)

        metrics |= {
            "kills": len(kills),
            "drives": len(drives),
            "deltas": sum(lost.deltas for lost in losses),
            "records": sum(lost.records for lost in losses),
            "lost_deltas_graph": lost_graph,
            "lost_deltas_log": lost_log,
            "unlogged": sum(lost.unlogged.total() for lost in losses),
            "cut_logs": CUTS_A_LOG * sum(len(attacked.logs) for attacked in drives),
        }
        for name, mode in (("lockstep", True), ("real_time", False)):
            of_mode = [each.kills for each in drives if each.is_lockstep is mode]
            if of_mode:
                metrics[f"back_s_{name}_p95"] = p95_s([kill for each in of_mode for kill in each])
        return {key: float(value) for key, value in metrics.items()}


def in_turn(parts: Sequence[str], random: Random) -> Iterator[str]:
    """Yield all parts in a random order, then again in another, without end."""
    while True:
        yield from random.sample(parts, len(parts))


def p95_s(kills: Sequence[Kill]) -> float:
    """Return the time after which commands came again, of 95 % of kills; one that stalled the drive
    counts as its bound.
    """
    times_s = [min(kill.back_s, STALLED_S) for kill in kills]
    return float(np.percentile(times_s, 95))
