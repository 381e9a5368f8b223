"""`cogmap experiment loop-closing`: figure 6 of the paper."""

from __future__ import annotations

import importlib
from functools import partial
from pathlib import Path
from typing import Any

import click

from cli.experiment import outcome
from cli.experiment.options import json_option, out_option, processes_option, seed_option
from cli.log.progress import bar
from experiments.loop_closing.run import METHODS, drive, figures, figures_of_rule
from experiments.parallel import each

NAME = "loop-closing"
_EPILOG = """\b
Example:
  cogmap experiment loop-closing --seed 2 --json loop.json
"""


@click.command(name=NAME, epilog=_EPILOG)
@seed_option
@processes_option
@out_option
@json_option
def loop_closing(seed: int, processes: int, out: Path | None, json_path: Path | None) -> None:
    """Figure 6: a way round some blocks, before and after its loop is closed by reverse replay.

    Driven twice, with positions corrected, which is the paper's rule, and with headings too. Percepts are not drawn:
    they err as perception was measured to. Takes about a minute.
    """
    folder = outcome.folder_for(NAME, out)
    with bar("driving round the blocks") as progress:
        loops = dict(zip(METHODS, each(partial(drive, seed), METHODS, processes, progress), strict=True))
    said = figures(loops) | figures_of_rule(seed)
    outcome.say(NAME, said)
    draw: Any = importlib.import_module("cli.experiment.loop_figure")  # other commands have no use for matplotlib
    outcome.save(folder, NAME, draw.figure(loops, said), said, seed, json_path)
