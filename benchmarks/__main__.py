"""`python -m benchmarks`: measures, prints a table of figures and bars, and writes flat JSON."""

from __future__ import annotations

import importlib
import os
import tempfile
from pathlib import Path
from typing import Any

import click

from benchmarks import cycle, deltas, message_loss
from benchmarks.localization import measure as localization
from benchmarks.map_correction import measure as map_correction
from benchmarks.perception import measure as perception
from benchmarks.perception import stereo as perception_stereo
from benchmarks.report import Bar, publish
from benchmarks.spiking import measure as spiking
from cli.experiment.outcome import save_figure
from cli.log.progress import bar
from cogmap.bus.session import free_endpoint
from cogmap.runtime.command import run_command
from services.epam.layout.road import DEFAULT_PATH as ROAD_WEIGHTS
from training.photographs import camvid_iou

BUS_BARS = {"delta_rate_ratio": Bar(0.5, at_least=True), "never_drop_lost": Bar(0)}


def _writable(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Better now than after minutes."""
    if path is not None and not path.parent.is_dir():
        raise click.BadParameter(f"there is no folder {path.parent}: make it first")
    return path


json_option = click.option(
    "--json",
    "json_path",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    callback=_writable,
    metavar="FILE",
    help="Write the figures there too, as one flat object.",
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def benchmarks() -> None:
    """Measure Cogmap on this machine.

    Each prints a table of what was measured, the bar it is held against, and whether it is met; a bar that is
    missed is a result, so the exit code is 0. Ratios are measured in one run. Leave the machine alone meanwhile.

    \b
    python -m benchmarks cycle --json cycle.json
    python -m benchmarks bus --json bus.json
    python -m benchmarks perception --json perception.json
    python -m benchmarks spiking --json spiking.json
    python -m benchmarks map_correction --graph manhattan.g2o --json map_correction.json
    """


@benchmarks.command(name="cycle")
@json_option
def cycle_command(json_path: Path | None) -> None:
    """The cycle's latency, the bus's share of it, the speed of a replay, the error of the estimate.

    Drives a lap of the demo's town in real time, every module a process, records it, and replays
    the log through sensory, epam, workspace and codelets. Takes about a minute and a half.
    """
    with tempfile.TemporaryDirectory() as folder:
        publish("cycle", cycle.measure(Path(folder), _tell), cycle.BARS, json_path)


@benchmarks.command(name="bus")
@click.option(
    "--pairs",
    type=click.IntRange(1, 99),
    default=7,
    show_default=True,
    help="How often to measure both rates, one right after the other; the ratio is the median.",
)
@click.option(
    "--deltas",
    "number",
    type=click.IntRange(100, 100_000),
    default=3000,
    show_default=True,
    help="Of each.",
)
@json_option
def bus_command(pairs: int, number: int, json_path: Path | None) -> None:
    """The rate of committed deltas against raw Zenoh puts, and what is lost in a minute.

    A workspace commits deltas of 31 KB that three replicas receive, validate and apply; the peer
    puts the same bytes through the same router to three subscribers. Then the whole system drives
    for 60 s, recorded. Takes about two minutes.
    """
    figures = deltas.measure(free_endpoint(), number, pairs, _tell)
    with tempfile.TemporaryDirectory() as folder:
        _tell(f"driving for {message_loss.RUN_S:g} s, counting what is lost")
        figures |= message_loss.measure(Path(folder))
    publish("bus", figures, BUS_BARS, json_path)


@benchmarks.command(name="perception")
@click.option(
    "--stereo",
    nargs=3,
    type=click.Path(path_type=Path),
    metavar="LEFT RIGHT DISPARITY",
    help="Measure only the stereo matching, on a rectified pair of yours: its images, and the true disparities of the "
    "left one, as an image of --scale times the pixels, 0 where unknown.",
)
@click.option(
    "--scale",
    type=click.FloatRange(0, min_open=True),
    metavar="N",
    help="Of --stereo; 1 if not given.",
)
@click.option(
    "--camvid-test",
    nargs=2,
    type=click.Path(path_type=Path),
    metavar="IMAGES LABELS",
    help="Measure only how well road is found in street photographs: two folders of PNG files with the same names, "
    "labelled as CamVid's 12 classes are.",
)
@click.option(
    "--road-weights",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Of --camvid-test: the road network, as python -m training road --camvid wrote it; "
    "that of the running system if not given.",
)
@json_option
def perception_command(
    stereo: tuple[Path, Path, Path] | None,
    scale: float | None,
    camvid_test: tuple[Path, Path] | None,
    road_weights: Path | None,
    json_path: Path | None,
) -> None:
    """What perception makes of towns that it never saw: names, new buildings, roads, depth, places,
    and how fast.

    Draws them, with light, noise and clutter, and looks at them with the modules of the running
    system, in two processes. Takes four to five minutes on two cores; leave both to it.
    """
    if scale is not None and not stereo:
        raise click.BadParameter("it belongs to --stereo: give that too", param_hint="--scale")
    if road_weights is not None and not camvid_test:
        raise click.BadParameter(
            "it belongs to --camvid-test: give that too", param_hint="--road-weights"
        )
    if not stereo and not camvid_test:
        publish("perception", perception.measure(), perception.BARS, json_path)
        return
    figures: dict[str, float] = {}
    bars: dict[str, Bar] = {}
    if stereo:
        figures, bars = perception_stereo.measure(*stereo, scale or 1.0)
    if camvid_test:
        figures["camvid_iou"] = camvid_iou(road_weights or ROAD_WEIGHTS, *camvid_test)
        bars["camvid_iou"] = Bar(0.85, at_least=True)
    publish("perception", figures, bars, json_path)


@benchmarks.command(name="localization")
@click.option(
    "--mrclam",
    "folder",
    required=True,
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="A folder of the UTIAS MRCLAM sets, as published, its files packed with xz or not.",
)
@click.option(
    "--processes",
    type=click.IntRange(1, 256),
    default=os.cpu_count() or 1,
    help="[default: one a core]",
)
@json_option
def localization_command(folder: Path, processes: int, json_path: Path | None) -> None:
    """How well real robots know where they are, on a map that is known and on one that they make;
    and how fast.

    Each of the set's robots alone, by the town's codelets: its sightings of other robots are left
    out. The map that it makes is turned to fit the truth, and held against gtsam's batch smoother,
    which `make bench-setup` installs. Takes some minutes.
    """
    publish("localization", localization.measure(folder, processes), localization.BARS, json_path)


@benchmarks.command(name="map_correction")
@click.option(
    "--graph",
    "graph_path",
    required=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A pose graph in the plane of yours: .g2o, or TORO's .graph; packed as .xz or not.",
)
@click.option(
    "--truth",
    "truth_path",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Its true poses, a line each: x, y and heading, with an index before them or not.",
)
@json_option
def map_correction_command(
    graph_path: Path, truth_path: Path | None, json_path: Path | None
) -> None:
    """How well and how fast loops are closed, on a pose graph that was recorded elsewhere.

    By the paper's rule, for positions only, against exact least squares; with headings too, against
    gtsam, which `make bench-setup` installs; and one closure at a time. Takes up to half a minute.
    """
    figures = map_correction.measure(graph_path, truth_path)
    bars = {key: bar for key, bar in map_correction.BARS.items() if key in figures}
    publish("map correction", figures, bars, json_path)


@benchmarks.command(name="spiking")
@click.option(
    "--seed", type=click.IntRange(0, 2**16), default=1, show_default=True, help="Which scenes."
)
@click.option(
    "--processes",
    type=click.IntRange(1, 256),
    default=os.cpu_count() or 1,
    help="[default: one a core]",
)
@click.option(
    "--figure",
    "folder",
    type=click.Path(file_okay=False, exists=True, path_type=Path),
    metavar="FOLDER",
    help="Draw figure 4 there too, spiking.png and spiking.pdf.",
)
@json_option
def spiking_command(seed: int, processes: int, folder: Path | None, json_path: Path | None) -> None:
    """The posterior that spikes of place cells give, against the exact one; and that by rejection
    of samples.

    Scenes with cues drawn at random: what path integration says of a position, and the distance to
    one or two walls. A ratio is of standard deviations along x and y, an error is of the mean in
    exact standard deviations.
    """
    with bar("recording") as progress:
        scenes = spiking.measure(seed, processes, progress)
    publish("spiking", spiking.figures(scenes), spiking.BARS, json_path)
    if folder is not None:
        figure: Any = importlib.import_module("benchmarks.spiking.figure")
        for path in save_figure(folder, "spiking", figure.figure(scenes, spiking.seeds(seed))):
            _tell(str(path))


def _tell(sentence: str) -> None:
    click.echo(sentence, err=True)


def main() -> None:
    """Run a benchmark; what the user can mend is one sentence and exit code 2."""
    run_command(benchmarks, "benchmarks", "python -m benchmarks")


if __name__ == "__main__":
    main()
