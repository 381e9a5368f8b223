"""`cogmap experiment loop-closing`: figure 6 of the paper."""

from __future__ import annotations

import importlib
from functools import partial
from pathlib import Path
from typing import Any

import click

from cli.experiment import live, outcome
from cli.experiment.options import (
    cameras_option,
    json_option,
    live_option,
    out_option,
    processes_option,
    seed_option,
)
from cli.log.progress import bar
from cogmap.parallel import parallel_map
from experiments.loop_closing.run import (
    METHODS,
    MIND,
    drive,
    drive_by_cameras,
    figures,
    figures_of_rule,
    sections,
)

NAME = "loop-closing"
_EPILOG = """\b
Examples:
  cogmap experiment loop-closing --seed 2 --json loop.json
  cogmap experiment loop-closing --cameras --live
"""


@click.command(name=NAME, epilog=_EPILOG)
@cameras_option
@live_option
@seed_option
@processes_option
@out_option
@json_option
def loop_closing(
    cameras: bool,
    goes_live: bool,
    seed: int,
    processes: int,
    out: Path | None,
    json_path: Path | None,
) -> None:
    """Figure 6: a way round some blocks, before and after its loop is closed by reverse replay.

    Driven twice, with positions corrected, which is the paper's rule, and with headings too.
    Percepts are not drawn: they err as perception was measured to; --cameras drives once more and
    draws them. Takes about a minute, or two.
    """
    folder = outcome.folder_for(NAME, out)
    with bar("driving round the blocks") as progress:
        loops = dict(
            zip(
                METHODS,
                parallel_map(partial(drive, seed), METHODS, processes, progress),
                strict=True,
            )
        )
    said = figures(loops) | figures_of_rule(seed)
    if cameras:
        with bar("driving with cameras") as progress:
            seen = figures(drive_by_cameras(seed, progress))
        said |= {f"cameras_{key}": value for key, value in seen.items()}
    differing = live.differing(sections(seed, "heading"), ("sim", *MIND)) if goes_live else []
    if goes_live:
        said["live_same"] = float(not differing)
    outcome.say(NAME, said)
    draw: Any = importlib.import_module(
        "cli.plots.loop_closing"
    )  # other commands have no use for matplotlib
    outcome.save(folder, NAME, draw.figure(loops, said), said, seed, json_path)
    live.check(differing)
