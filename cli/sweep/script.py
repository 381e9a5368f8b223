"""`cogmap.sweep`: several drives from a script or a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from cogmap.cli.run.folder import RUNS
from cogmap.cli.run.script import DriveOptions

if TYPE_CHECKING:
    from cogmap.cli.sweep.plan import Settings
    from cogmap.cli.sweep.result import Sweep

SWEEP = RUNS / "sweep"


def sweep(
    seeds: Iterable[int],
    settings: Sequence[Settings] = ({},),
    *,
    out: Path | str = SWEEP,
    processes: int = 1,
    **options: Unpack[DriveOptions],
) -> Sweep:
    """Drive once with each of `seeds` and each variant of `settings`, `processes` drives at once.

    The options are those of `cogmap.run`; drives are in lockstep unless `lockstep=False`, so that
    what they find does not depend on how busy the machine is. Each leaves its files in a folder of
    `out`. What has a summary there already, of the same options, is not driven again: a sweep that
    was interrupted goes on where it was.

        found = cogmap.sweep(
            seeds=range(1, 6),
            settings=[{"motor.cruise_m_s": 2.0}, {"motor.cruise_m_s": 4.0}],
            town="blocks", explore_s=30.0,
        )
        for statistics in found.statistics():
            print(statistics.settings, statistics.mean["estimate.mean_m"])
        found.table().to_pandas()

    A drive that fails is one of the result's `failed`, whose `error` says why. Raises UsageError
    for options that do not fit, and if the folder has drives of others.
    """
    # It takes a while to import.
    from cogmap.cli.sweep.execution import drive_all

    return drive_all(Path(out), list(seeds), settings, {}, processes, options)
