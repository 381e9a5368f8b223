"""`cogmap experiment loop-closing`: figure 6 of the paper."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from cogmap.cli.experiment import live, results
from cogmap.cli.experiment.options import Common, common_options
from cogmap.cli.progress import bar
from cogmap.experiments.loop_closing.metrics import loop_metrics, rule_metrics, solver_metrics
from cogmap.experiments.loop_closing.observer import Loop
from cogmap.experiments.loop_closing.run import METHODS, MODULES, drive, drive_by_cameras, sections
from cogmap.experiments.loop_closing.solvers import solvers
from cogmap.parallel import parallel_map

NAME = "loop-closing"
_EPILOG = """\b
Examples:
  cogmap experiment loop-closing --seed 2 --json loop.json
  cogmap experiment loop-closing --cameras --live
"""


@click.command(name=NAME, epilog=_EPILOG)
@common_options
def loop_closing(common: Common) -> None:
    """Make figure 6: a path around some blocks, before and after reverse replay closes its loop.

    The agent drives twice: positions are corrected, by reverse replay (eq. 9 as it is printed with
    --rules paper), or headings too. The constraints of the loop that is closed first are solved by
    Gauss-Seidel iteration as well, pass by pass. Percepts are not rendered: they have the measured
    errors of perception. --cameras drives once more with rendered images. Takes one or two minutes.
    """
    folder = results.folder_for(NAME, common.out)
    rules = results.show_rules(common)
    loops = _drive(common)
    solved = solvers(loops["positions"])
    metrics: dict[str, Any] = loop_metrics(loops) | rule_metrics(common.seed) | rules
    metrics |= solver_metrics(solved)

    if common.cameras:
        with bar("driving with cameras") as progress:
            seen = loop_metrics(drive_by_cameras(common.seed, progress, common.rules))
        metrics |= {f"cameras_{key}": value for key, value in seen.items()}

    differing = None
    if common.live:
        differing = live.differing(sections(common.seed, "heading", common.rules), MODULES)
        metrics[live.SAME] = float(not differing)

    results.show(NAME, metrics)

    from cogmap.cli.plots.loop_closing import figure  # matplotlib takes long to import

    results.save(folder, NAME, figure(loops, solved, metrics), metrics, common)
    live.check(differing)


def _drive(common: Common) -> dict[str, Loop]:
    with bar("driving round the blocks") as progress:
        work = partial(drive, common.seed, rules=common.rules)
        loops = parallel_map(work, METHODS, common.processes, progress)

    return dict(zip(METHODS, loops, strict=True))
