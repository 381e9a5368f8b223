"""What a sweep found: the summaries of its drives, their means and standard deviations."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

import msgspec

from cogmap.cli.sweep.plan import Settings, label
from cogmap.recording.table import arrow_library

if TYPE_CHECKING:
    import pyarrow

    from cogmap.cli.launch.drive_metrics import RunMetrics

Figure = bool | int | float | str
SHOWN = {
    "distance_m": "driven m",
    "goals_reached": "goals",
    "estimate.mean_m": "error m",
    "estimate.max_m": "at most m",
    "fused_alone.mean_m": "fused m",
    "wheels_alone.mean_m": "wheels m",
    "error_over_fused": "over fused",
    "objects": "objects",
}
"""The figures that the table on the screen has, and their columns: the mean error of the estimate,
beside those of path integration alone.
"""


@dataclass(frozen=True)
class SweptDrive:
    """A drive of a sweep, with the settings that vary; `summary` is None where it left none, and
    `error` says why it failed, empty where it did not.
    """

    seed: int
    settings: Settings
    folder: Path
    summary: RunMetrics | None
    error: str

    def figures(self) -> dict[str, Figure]:
        """Return every figure of the summary that is one value, by its path: `estimate.mean_m`."""
        return {} if self.summary is None else dict(_figures(self.summary, ""))


@dataclass(frozen=True)
class Statistics:
    """Of the drives of one variant of the settings: how many did not fail, and of these the mean
    and the standard deviation of each figure that is a number; None where there are too few.
    """

    settings: Settings
    drives: int
    mean: Mapping[str, float | None]
    sd: Mapping[str, float | None]


@dataclass(frozen=True)
class Sweep:
    """The drives of a sweep, in its `folder`."""

    folder: Path
    drives: Sequence[SweptDrive]

    @property
    def failed(self) -> list[SweptDrive]:
        """Return the drives that failed."""
        return [drive for drive in self.drives if drive.error]

    def table(self) -> pyarrow.Table:
        """Return a row a drive, a column a figure, as an Arrow table, which has `to_pandas()`.

        Raises UsageError if there is no pyarrow.
        """
        return arrow_library().Table.from_pylist(self.rows())

    def rows(self) -> list[dict[str, Any]]:
        """Return a row a drive: its seed, its settings, its figures, and why it failed."""
        found = []
        for drive in self.drives:
            about = {"seed": drive.seed, **drive.settings, "folder": str(drive.folder)}
            found.append(about | drive.figures() | {"error": drive.error})
        columns = dict.fromkeys(name for row in found for name in row)
        return [{name: row.get(name) for name in columns} for row in found]

    def csv(self) -> str:
        """Write the rows as CSV, with a line of names."""
        rows = self.rows()
        text = StringIO()
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return text.getvalue()

    def statistics(self) -> list[Statistics]:
        """Return the statistics of each variant of the settings."""
        variants: dict[str, list[SweptDrive]] = {}
        for drive in self.drives:
            variants.setdefault(label(drive.settings), []).append(drive)
        return [_statistics(drives) for drives in variants.values()]


def _figures(part: msgspec.Struct, prefix: str) -> Iterator[tuple[str, Figure]]:
    """Yield the figures of a part of a summary, by their paths; none of what was not measured."""
    from cogmap.cli.launch.drive_metrics import ErrorMetrics  # it takes a while to import

    if isinstance(part, ErrorMetrics) and not part.is_measured:
        return
    for name in part.__struct_fields__:
        value = getattr(part, name)
        if isinstance(value, msgspec.Struct):
            yield from _figures(value, f"{prefix}{name}.")
        elif isinstance(value, Figure):
            yield prefix + name, value


def _statistics(drives: Sequence[SweptDrive]) -> Statistics:
    whole = [drive.figures() for drive in drives if not drive.error]
    names = dict.fromkeys(name for figures in whole for name in figures)
    mean: dict[str, float | None] = {}
    sd: dict[str, float | None] = {}
    for name in names:
        values = [figures[name] for figures in whole if name in figures]
        numbers = [float(value) for value in values if _is_number(value)]
        if numbers:
            mean[name] = fmean(numbers)
            sd[name] = stdev(numbers) if len(numbers) > 1 else None
    return Statistics(drives[0].settings, len(whole), mean, sd)


def _is_number(value: Figure) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
