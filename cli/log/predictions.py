"""`cogmap log predictions`: what a drive predicts of place cells."""

from __future__ import annotations

from pathlib import Path

import click
from rich.console import Console

from cogmap.cli.files import check_picture, save
from cogmap.cli.log.inspect import log_argument
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.experiments.predictions.drive import FOLLOWED, Drive, Follower, Metrics, metrics_of
from cogmap.recording.log import open_log
from cogmap.services.codelets.config import SECTION, Config

PLOTS = (".png", ".pdf")
_EPILOG = """\b
Examples:
  cogmap run --laps 2 --out drive                  a drive that returns
  cogmap log predictions drive                     drive-predictions.png
  cogmap log predictions drive -o figure.pdf --json
  cogmap experiment predictions FILE.nwb --log drive    beside a recording of place cells
"""


@click.command(epilog=_EPILOG)
@click.option(
    "-o",
    "--figure",
    "output",
    type=click.Path(path_type=Path),
    help="The figure.  [default: LOG-predictions.png]",
)
@json_option
@log_argument
def predictions(log: Path, output: Path | None, as_json: bool) -> None:
    """Draw what the drive in LOG predicts of place cells (paper, section 5.6), as PNG or PDF.

    How often places were replayed in reverse, beside how often they were revisited; how far their
    fields shift, by the distance along the loop from where it was closed; and how the synapses
    between them change, exp(-k d), by the distance d of their fields. The messages of LOG are
    counted for the first, the other two are of the first correction. By the rules eq9 and positions
    (codelets.correct) a replay is a reverse pass over the loop; by heading, which is beyond the
    paper, it is a solution for the whole path.
    """
    path = output or Path(f"{log.stem}-predictions{PLOTS[0]}")
    check_picture("-o", path, PLOTS)
    drive = read_drive(log)
    metrics = metrics_of(drive)

    from cogmap.cli.plots.predictions import drive_figure, encode  # matplotlib takes long to import

    save(path, encode(drive_figure(drive, metrics, log.name), path.suffix.lower()))
    if as_json:
        print_json({"figure": str(path), **metrics})
        return

    for line in described(metrics):
        click.echo(line)
    Console().print(path)


def read_drive(log: Path) -> Drive:
    """Read what a log shows. Raises LogError if it is none, or no loop was closed in it."""
    with open_log(log) as opened, bar(f"reading {log.name}") as progress:
        section = opened.config.get(SECTION, {})
        rule = str(section.get("correct", Config().correct))
        follower = Follower(rule, float(section.get("revisit_s", Config().revisit_s)))
        for entry in opened.messages(*FOLLOWED):
            follower.update(entry.message)
            progress(entry.time_s / max(opened.duration_s, 1e-9))
        return follower.drive(str(log))


def described(metrics: Metrics) -> list[str]:
    """Write the three predictions in a sentence each."""
    ratio = metrics["replays_over_revisits"]
    times = "no revisit is known" if ratio is None else f"{ratio:.1f} times as many"
    return [
        f"corrected by the rule {metrics['correction_rule']}",
        f"replays: {metrics['replays']} in {metrics['corrections']} corrections, of "
        f"{metrics['revisits']} revisits: {times}",
        f"shifts of place fields: {metrics['shift_near_closure_m']:.2f} m where the loop was "
        f"closed, {metrics['shift_far_from_closure_m']:.2f} m at its other end, "
        f"{metrics['loop_m']:.0f} m along it",
        f"synapses: {metrics['strength_change_per_m_close_pairs']:.3f} a metre that fields come "
        f"nearer, r = {metrics['strength_and_shift_correlation_close_pairs']:.2f}, over "
        f"{metrics['close_pairs']:.0f} close pairs",
    ]
