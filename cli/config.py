"""`cogmap config`: every setting of every module."""

from __future__ import annotations

from pathlib import Path
from typing import IO

import click

from cli.launch.plan import Choices, awaited, effective, to_toml
from cli.options import config_option, set_option
from cli.run.command import codelets_option, laps_option, lockstep_option, seed_option
from cogmap.runtime import config


@click.command(name="config")
@seed_option
@laps_option
@lockstep_option
@codelets_option
@click.option("--record/--no-record", default=True, help="Whether the drive waits for a recorder.")
@click.option(
    "-o",
    "--output",
    type=click.File("w", encoding="utf-8", atomic=True),
    default="-",
    help="Where to write it.",
)
@config_option
@set_option
def print_config(
    seed: int | None,
    laps: float | None,
    lockstep: bool,
    codelets: int,
    record: bool,
    output: IO[str],
    config_path: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Write the whole configuration of a drive as TOML: for modules that are started one by one."""
    choices = Choices(seed=seed, laps=laps, lockstep=lockstep, codelets=codelets, record=record)
    sections = effective(
        config.load(config_path, settings), choices, awaited(choices, observer=False)
    )
    output.write(to_toml(sections))
