"""`cogmap experiment predictions`: the paper's predictions in recordings of place cells."""

from __future__ import annotations

import logging
from pathlib import Path

import click

from cogmap.cli.experiment import results
from cogmap.cli.experiment.options import Common, common_options_without_sensing
from cogmap.cli.log.predictions import read_drive
from cogmap.cli.progress import bar
from cogmap.data import nwb
from cogmap.errors import UsageError
from cogmap.experiments.predictions import synthetic
from cogmap.experiments.predictions.measure import Found, measure
from cogmap.experiments.predictions.metrics import metrics_of

NAME = "predictions"
_EPILOG = """\b
Examples:
  cogmap experiment predictions --example example.nwb    a file to try it with
  cogmap experiment predictions example.nwb
  cogmap experiment predictions rat.nwb --log drive --json rat.json
  cogmap experiment predictions rat.nwb --position maze_xy --rests sleep --events ripples
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.argument("recording", type=click.Path(path_type=Path), required=False, metavar="[FILE.nwb]")
@click.option(
    "--log",
    type=click.Path(path_type=Path),
    metavar="LOG",
    help="The log of a drive, whose predictions are drawn and printed beside the recording.",
)
@click.option(
    "--position",
    metavar="NAME",
    help="The SpatialSeries in the module `behavior`, if there are several.",
)
@click.option(
    "--events",
    metavar="TABLE",
    help="A table of intervals with candidate replay events.  [default: bursts of all place cells]",
)
@click.option(
    "--rests",
    metavar="TABLE",
    help="A table of intervals of rest.  [default: where the animal moves less than 5 cm/s]",
)
@click.option(
    "--example",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write a synthetic recording to FILE, and end.",
)
@click.option(
    "--without-effects",
    is_flag=True,
    help="With --example: the same track and cells, but none of the predicted effects.",
)
@common_options_without_sensing
def predictions(
    common: Common,
    recording: Path | None,
    log: Path | None,
    position: str | None,
    events: str | None,
    rests: str | None,
    example: Path | None,
    without_effects: bool,
) -> None:
    """Look for the paper's predictions of place cells (section 5.6) in a recording: FILE.nwb.

    It needs the positions of an animal that runs a loop more than once, as a SpatialSeries in the
    module `behavior`, and the spike times of units. The loop is closed when the animal first comes
    back to a place. From then on: reverse replays in rest (rank correlation of spikes with the
    order of fields, against shuffled cells) beside returns to the fields; the shift of each field,
    beside how it differs from pass to pass later; and how pairs of cells fire together in rest,
    after less before, by how much nearer their fields came. Each has its number, a 95 % interval
    and a p.

    "found" takes p < 0.05 and an interval on the predicted side; "undecided" means too few events,
    cells or pairs. It needs pynwb: pip install 'cogmap[recordings]'. Takes seconds.
    """
    if (recording is None) == (example is None):
        raise UsageError("give either a recording, FILE.nwb, or --example FILE to write one")
    # pandas, which pynwb needs, imports it if it is there, and it logs that.
    logging.getLogger("numexpr").setLevel(logging.WARNING)
    if example is not None:
        _write_example(example, common.seed, has_effects=not without_effects)
        return
    if without_effects:
        raise UsageError("--without-effects is for --example: leave it out")

    assert recording is not None
    folder = results.folder_for(NAME, common.out)
    with bar(f"reading {recording.name}"):
        read = nwb.read(recording, position, events, rests)
    drive = None if log is None else read_drive(log)
    with bar("measuring"):
        found = measure(read, common.seed)

    metrics = metrics_of(found, drive)
    results.show(NAME, metrics)
    for line in _described(found):
        click.echo(line)

    from cogmap.cli.plots.recordings import figure  # matplotlib takes long to import

    results.save(folder, NAME, figure(found, drive), metrics, common)


def _write_example(path: Path, seed: int, *, has_effects: bool) -> None:
    effects = [*synthetic.Effect] if has_effects else []
    made = synthetic.recording(seed, effects)
    nwb.write(made, path)
    click.echo(f"{path}: {made.description}")


def _described(found: Found) -> list[str]:
    """Write what was found of each prediction in a sentence."""
    return [
        f"reverse replay more often than revisits: {found.replays.verdict.value} "
        f"({found.replays.tested} events)",
        f"place fields shift after a revisit: {found.shifts.verdict.value} "
        f"({len(found.shifts.shift_m)} cells)",
        f"synapses change with the shifts: {found.synapses.verdict.value} "
        f"({int(found.synapses.close.sum())} close pairs)",
    ]
