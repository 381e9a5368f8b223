"""Options that the experiments share."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from cogmap.cli.options import rules_option
from cogmap.errors import UsageError
from cogmap.services.codelets.rules import OURS

Command = Callable[..., None]


@dataclass(frozen=True)
class Common:
    """What the user chose of the options that every experiment has. `rules` is a preset of the
    agent's.
    """

    cameras: bool
    live: bool
    seed: int
    processes: int
    out: Path | None
    json_path: Path | None
    rules: str


def _writable(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Refuse a file that cannot be written before minutes of driving."""
    if path is not None and not path.parent.is_dir():
        raise UsageError(f"--json {path}: there is no folder {path.parent}: make it first")

    return path


_SENSING_OPTIONS = (
    rules_option,
    click.option(
        "--cameras",
        is_flag=True,
        help="Run once more with rendered camera images, perceived by sensory and epam.",
    ),
    click.option(
        "--live",
        is_flag=True,
        help="Run once more with real processes, and compare bytes; ends with 1 if they differ.",
    ),
)
_OPTIONS = (
    click.option(
        "--seed",
        type=click.IntRange(0, 2**32),
        default=1,
        show_default=True,
        help="Seed of all noise; the same seed gives the same bytes.",
    ),
    click.option(
        "--processes",
        type=click.IntRange(1, 256),
        default=os.cpu_count() or 1,
        help="Processes that run at once; metrics do not depend on it.  [default: one per core]",
    ),
    click.option(
        "--out",
        type=click.Path(path_type=Path),
        help="The folder for its files.  [default: runs/NAME]",
    ),
    click.option(
        "--json",
        "json_path",
        type=click.Path(dir_okay=False, path_type=Path),
        callback=_writable,
        metavar="FILE",
        help="Write the metrics to FILE too, as one flat JSON object.",
    ),
)


def common_options(command: Command) -> Command:
    """Give `command` the shared options, as a `Common`, its first argument."""
    return _with(command, (*_SENSING_OPTIONS, *_OPTIONS))


def common_options_without_sensing(command: Command) -> Command:
    """Give `command` the shared options but --rules, --cameras and --live, as no agent senses."""
    return _with(command, _OPTIONS)


def _with(command: Command, options: Sequence[Callable[[Command], Command]]) -> Command:
    @functools.wraps(command)
    def with_common(
        *,
        seed: int,
        processes: int,
        out: Path | None,
        json_path: Path | None,
        cameras: bool = False,
        live: bool = False,
        rules: str | None = None,
        **own: Any,
    ) -> None:
        common = Common(cameras, live, seed, processes, out, json_path, rules or OURS)
        command(common, **own)

    decorated: Command = with_common
    for option in reversed(options):
        decorated = option(decorated)

    return decorated
