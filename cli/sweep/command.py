"""`cogmap sweep`: several drives, their means and standard deviations."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, cast

import click
from click.core import ParameterSource

from cogmap.cli.files import save
from cogmap.cli.options import FiniteRange, json_option, rules_option
from cogmap.cli.printing import print_json, print_table
from cogmap.cli.run.options import (
    codelets_option,
    energy_option,
    explore_option,
    goals_option,
    laps_option,
    tour_option,
    town_option,
)
from cogmap.cli.run.script import DriveOptions
from cogmap.cli.sweep.execution import drive_all
from cogmap.cli.sweep.options import every_variant, read_seeds
from cogmap.cli.sweep.plan import label
from cogmap.cli.sweep.result import SHOWN, Statistics, Sweep
from cogmap.cli.sweep.script import SWEEP
from cogmap.errors import UsageError
from cogmap.runtime import config
from cogmap.runtime.program import config_option, set_option

_EPILOG = """\b
Examples:
  cogmap sweep --seeds 1-5 --town blocks --explore 30
  cogmap sweep --seeds 1-5 --vary motor.cruise_m_s=2,3,4 --processes 4
  cogmap sweep --seeds 1-5 --rules paper --out runs/paper    by the paper's own rules
  cogmap sweep --seeds 1,4,9 --tour --out runs/tours --csv tours.csv
"""


@click.command("sweep", epilog=_EPILOG)
@click.option(
    "--seeds",
    default="1-5",
    show_default=True,
    callback=lambda _context, _option, text: read_seeds(text),
    help="Drive once with each of these seeds: numbers, and ranges of them.",
)
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="MODULE.KEY=VALUE,VALUE...",
    help="Drive with each of these values; may be repeated, for every combination.",
)
@town_option
@tour_option
@explore_option
@goals_option
@laps_option
@energy_option
@codelets_option
@rules_option
@click.option(
    "--lockstep/--real-time",
    default=True,
    help="In lockstep the results do not depend on how busy the machine is.  [default: lockstep]",
)
@click.option(
    "--record/--no-record", default=True, help="Record each drive's messages in a log, or none."
)
@click.option(
    "--time-limit",
    "time_limit_s",
    type=FiniteRange(5, 1e6),
    metavar="SECONDS",
    help="End each drive after this much time.  [default: an hour in lockstep, else that of "
    "`cogmap run`]",
)
@click.option(
    "--processes",
    type=click.IntRange(1, 256),
    default=1,
    show_default=True,
    help="Drives that go on at once; each has some twelve processes.",
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=SWEEP,
    show_default=True,
    help="The folder for the drives; what was driven there before is not driven again.",
)
@click.option(
    "--csv",
    "csv_path",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write every figure to FILE, a row a drive.",
)
@json_option
@config_option
@set_option
@click.pass_context
def sweep_command(
    context: click.Context,
    /,
    seeds: list[int],
    varied: tuple[str, ...],
    processes: int,
    out: Path,
    csv_path: Path | None,
    as_json: bool,
    config_path: Path | None,
    settings: tuple[str, ...],
    **options: Any,
) -> None:
    """Drive once with each seed and each variant of the settings, and compare.

    Every drive is one of `cogmap run`, with its files in a folder of its own. Prints a row a drive,
    and of each variant the mean and the standard deviation (SD) over the drives that did not fail.
    A sweep that was interrupted goes on where it was. Ends with 1 if a drive failed; its row says
    why.
    """
    if csv_path is not None and not csv_path.parent.is_dir():
        raise UsageError(f"--csv {csv_path}: there is no folder {csv_path.parent}: make it first")

    common = _by_key(config.load(None, settings))
    chosen = _given(context, options)
    if config_path is not None:
        chosen["config"] = config_path
    found = drive_all(out, seeds, every_variant(varied), common, processes, chosen)
    if csv_path is not None:
        save(csv_path, found.csv().encode())
    if as_json:
        print_json(_document(found))
    else:
        _print(found)
    if found.failed:
        sys.exit(1)


def _given(context: click.Context, options: dict[str, Any]) -> DriveOptions:
    """Return the options that the user gave: the others are those of `cogmap run`, whatever these
    are.
    """
    default = ParameterSource.DEFAULT
    given = {
        name: value
        for name, value in options.items()
        if context.get_parameter_source(name) is not default
    }
    return cast(DriveOptions, given)


def _by_key(sections: config.Sections) -> dict[str, Any]:
    """Return settings by module.key."""
    return {
        f"{section}.{key}": value
        for section, values in sections.items()
        for key, value in values.items()
    }


def _document(found: Sweep) -> dict[str, Any]:
    return {"folder": str(found.folder), "drives": found.rows(), "statistics": found.statistics()}


def _print(found: Sweep) -> None:
    """Print a row a drive, then the mean and the SD of each variant."""
    rows = []
    for drive in found.drives:
        figures = drive.figures()
        shown = [_text(figures.get(name)) for name in SHOWN]
        ended = drive.error or (drive.summary.ended_by if drive.summary else "")
        rows.append([label(drive.settings), str(drive.seed), *shown, ended])
    for statistics in found.statistics():
        rows += _rows_of(statistics)
    print_table(("settings:", "seed", *SHOWN.values(), "end:"), rows)
    click.echo(f"{len(found.drives)} drives in {found.folder}, {len(found.failed)} of them failed")


def _rows_of(statistics: Statistics) -> list[list[str]]:
    name = label(statistics.settings)
    number = f"{statistics.drives} drives"
    rows = []
    for word, values in (("mean", statistics.mean), ("SD", statistics.sd)):
        shown = [_text(values.get(figure)) for figure in SHOWN]
        rows.append([name, word, *shown, number])
    return rows


def _text(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.3f}" if isinstance(value, float) else str(value)
