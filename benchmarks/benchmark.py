"""A row of the table of benchmarks, and the setting that its measuring runs in."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from benchmarks.report import Metrics
from benchmarks.threshold import Thresholds
from cogmap.errors import UsageError


@dataclass(frozen=True)
class Setting:
    """A run of a benchmark: its files go to `folder`, `announce` prints a sentence for the user."""

    folder: Path
    processes: int
    announce: Callable[[str], None]


@dataclass(frozen=True)
class Benchmark:
    """A benchmark, from which the command of its name and its run in `all` are made.

    `measure` takes a Setting and the values of `options` by name, and returns metrics by key; its
    docstring is the command's help. In `all` it gets `arguments`, and for each key of `data` paths
    within the folder that the user gives. `option_thresholds` are of metrics that are measured only
    if an option is given. Without `has_command` it is the command of another row, or of
    `cogmap experiment`, run with arguments. One that is not `in_all` runs there with --only alone.
    """

    name: str
    thresholds: Thresholds
    measure: Callable[..., Metrics]
    options: Sequence[click.Option] = ()
    data: Mapping[str, str | Sequence[str]] = field(default_factory=dict)
    arguments: Mapping[str, object] = field(default_factory=dict)
    option_thresholds: Thresholds = field(default_factory=dict)
    has_command: bool = True
    in_all: bool = True

    def arguments_in_all(self, data: Path | None) -> dict[str, Any]:
        """Return the arguments that `all` calls `measure` with. Raises UsageError if `data`, the
        folder of published sets, lacks one of them.
        """
        given = dict(self.arguments)
        for option, names in self.data.items():
            if isinstance(names, str):
                given[option] = _path_in(data, names)
            else:
                given[option] = tuple(_path_in(data, name) for name in names)

        return given


def _path_in(data: Path | None, name: str) -> Path:
    set_name = Path(name).parts[0]
    if data is None:
        raise UsageError(f"it measures on the set {set_name}: give its folder with --data")
    if not (data / set_name).is_dir():
        raise UsageError(f"there is no folder {data / set_name}: put the set there")

    return data / name


PROCESSES = click.Option(
    ["--processes"],
    type=click.IntRange(1, 256),
    default=os.cpu_count() or 1,
    help="How many run at once.  [default: one a core]",
)


def path_option(*names: str, metavar: str, text: str, **settings: Any) -> click.Option:
    """Return an option that takes a file or a folder."""
    return click.Option(
        names, type=click.Path(path_type=Path), metavar=metavar, help=text, **settings
    )
