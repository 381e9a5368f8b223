"""The commands of `python -m benchmarks`."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console

from benchmarks import suite
from benchmarks.bus import measure as bus
from benchmarks.cognition.command import cognition_command
from benchmarks.cycle import measure as cycle
from benchmarks.explore.command import explore_command
from benchmarks.learning.command import learning_command
from benchmarks.lifelong.command import lifelong_command
from benchmarks.localization import measure as localization
from benchmarks.map_correction import false_groups
from benchmarks.map_correction import measure as map_correction
from benchmarks.map_size import measure as map_size
from benchmarks.map_structure import measure as map_structure
from benchmarks.memory.command import memory_command
from benchmarks.options import announce, json_option, processes_option, report_metrics
from benchmarks.perception.command import perception_command
from benchmarks.place_grid import measure as place_grid
from benchmarks.planning.command import planning_command
from benchmarks.report import Outcome, summary, write
from benchmarks.spiking import measure as spiking
from cogmap.cli.experiment.results import save_figure
from cogmap.cli.progress import bar


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def benchmarks() -> None:
    """Measure Cogmap on this machine.

    Each prints a table of what was measured, the threshold beside it, and whether it is met; only
    `all` ends with code 1 where one is missed. Ratios are measured in one run. Timings stand beside
    machine_unit_ms, the time of one stereo matching, so that two machines can be compared. Leave
    the machine alone meanwhile.

    \b
    python -m benchmarks all --data DIR --json all.json
    python -m benchmarks cycle --json cycle.json
    python -m benchmarks map_correction --graph manhattan.g2o --json map_correction.json
    """


@benchmarks.command(name="all")
@click.option(
    "--data",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="DIR",
    help="Sets that others published, a folder each: mrclam6, pose_graphs, stereo_cones, camvid, "
    "street_grids, tsplib, human_tsp.",
)
@click.option(
    "--only", type=click.Choice(suite.NAMES), multiple=True, help="Just this one; repeatable."
)
@click.option(
    "--skip", type=click.Choice(suite.NAMES), multiple=True, help="Not this one; repeatable."
)
@processes_option
@json_option
def all_command(
    data: Path | None,
    only: tuple[str, ...],
    skip: tuple[str, ...],
    processes: int,
    json_path: Path | None,
) -> None:
    """Every benchmark and experiment that has a threshold, in one table.

    Ends with code 1 where a threshold is missed. A benchmark that fails is a row with its reason,
    and counts as missed. Takes more than two hours on two cores.
    """
    chosen = suite.selected(only, skip)
    with tempfile.TemporaryDirectory() as folder:
        setting = suite.Setting(Path(folder), processes, data, announce)
        outcomes = _run_all(chosen, setting, json_path)

    Console().print(summary(outcomes))

    if any(outcome.failure or outcome.missed for outcome in outcomes):
        sys.exit(1)


def _run_all(
    chosen: Sequence[suite.Benchmark], setting: suite.Setting, json_path: Path | None
) -> list[Outcome]:
    """Run one benchmark after the other; what is measured is written after each."""
    outcomes = []
    for number, benchmark in enumerate(chosen, start=1):
        setting.announce(f"[{number}/{len(chosen)}] {benchmark.name}")
        outcome = suite.run(benchmark, setting)
        outcomes.append(outcome)

        if json_path is not None:
            write(json_path, suite.merged(outcomes))

    return outcomes


@benchmarks.command(name="cycle")
@processes_option
@json_option
def cycle_command(processes: int, json_path: Path | None) -> None:
    """The cycle's latency, the bus's share of it, the speed of a replay, the error of the estimate.

    Drives a lap of the demo's town in real time, every module a process, records it, and replays
    the log through sensory, epam, workspace and codelets. Then it drives three laps of three towns
    in lockstep, to compare the estimate with fused self-motion alone. Takes about six minutes.
    """
    with tempfile.TemporaryDirectory() as folder:
        metrics = cycle.measure(Path(folder), processes, announce)

    report_metrics("cycle", cycle.THRESHOLDS, metrics, json_path)


@benchmarks.command(name="map_size")
@json_option
def map_size_command(json_path: Path | None) -> None:
    """The cycle, its deltas and tasks, a late worker and a replica, on a map of 100,000 objects.

    The cognitive modules run on the in-memory bus with percept-level sensing, once on a map of 100
    objects and 1,000 place nodes, once on one of 100,000 and 500,000. A worker of its own process
    then joins over Zenoh. Takes about two minutes.
    """
    metrics = map_size.measure(announce)
    report_metrics("map_size", map_size.THRESHOLDS, metrics, json_path)


@benchmarks.command(name="place_grid")
@json_option
def place_grid_command(json_path: Path | None) -> None:
    """A change of a tile on a map of 500,000 place nodes, and what these take in a replica.

    The change writes every column of every cell of the tile: it is validated, committed and encoded
    as the workspace does it, and decoded and applied as a replica does. Takes a few seconds.
    """
    metrics = place_grid.measure(announce)
    report_metrics("place grid", place_grid.THRESHOLDS, metrics, json_path)


@benchmarks.command(name="map_structure")
@json_option
def map_structure_command(json_path: Path | None) -> None:
    """How well sub-maps find the districts of towns again, and how fast.

    Towns made up from seeds, with known districts and boundaries between most of them. The adjusted
    Rand index is compared with that of scikit-learn's Gaussian mixture with a Dirichlet-process
    prior on the same positions, which `make bench-setup` installs. Takes about two minutes.
    """
    metrics = map_structure.measure(announce)
    report_metrics("map structure", map_structure.THRESHOLDS, metrics, json_path)


@benchmarks.command(name="bus")
@click.option(
    "--pairs",
    type=click.IntRange(1, 99),
    default=bus.PAIRS,
    show_default=True,
    help="How often to measure both rates, one right after the other; the ratio is the median.",
)
@click.option(
    "--deltas",
    "number",
    type=click.IntRange(100, 100_000),
    default=bus.DELTAS,
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
    with tempfile.TemporaryDirectory() as folder:
        metrics = bus.measure(Path(folder), announce, number, pairs)

    report_metrics("bus", bus.THRESHOLDS, metrics, json_path)


@benchmarks.command(name="localization")
@click.option(
    "--mrclam",
    "folder",
    required=True,
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="A folder of the UTIAS MRCLAM sets, as published, its files packed with xz or not.",
)
@processes_option
@json_option
def localization_command(folder: Path, processes: int, json_path: Path | None) -> None:
    """How well real robots localize, on a map that is known and on one that they make; how fast.

    Each of the set's robots alone, through the town's workspace and codelets; observations of other
    robots are left out. The map that it makes is aligned with the truth, and compared with gtsam's
    batch smoother, which `make bench-setup` installs. Takes some minutes.
    """
    metrics = localization.measure(folder, processes)
    report_metrics("localization", localization.THRESHOLDS, metrics, json_path)


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
@click.option(
    "--false-groups",
    "has_false_groups",
    is_flag=True,
    help="Add false closures, alone and in groups that agree, and tell which are believed.",
)
@processes_option
@json_option
def map_correction_command(
    graph_path: Path,
    truth_path: Path | None,
    has_false_groups: bool,
    processes: int,
    json_path: Path | None,
) -> None:
    """How well and how fast loops are closed, on a pose graph that was recorded elsewhere.

    By the paper's rule, for positions only, against exact least squares; with headings too, against
    gtsam, which `make bench-setup` installs; and one closure at a time. Takes up to half a minute.
    With --false-groups instead: 10, 50 and 100 false closures, alone and in groups of 3 and 5; the
    errors that they cause are measured where there is a --truth. Takes some minutes.
    """
    if has_false_groups:
        with bar("judging false closures") as progress:
            metrics = false_groups.measure(graph_path, truth_path, processes, progress)
        report_metrics("false closures", false_groups.THRESHOLDS, metrics, json_path)
        return

    metrics = map_correction.measure(graph_path, truth_path)
    report_metrics("map correction", map_correction.THRESHOLDS, metrics, json_path)


@benchmarks.command(name="spiking")
@click.option(
    "--seed",
    type=click.IntRange(0, 2**16),
    default=spiking.SEED,
    show_default=True,
    help="Which scenes.",
)
@processes_option
@click.option(
    "--figure",
    "folder",
    type=click.Path(file_okay=False, exists=True, path_type=Path),
    metavar="FOLDER",
    help="Draw figure 4 there too, spiking.png and spiking.pdf.",
)
@json_option
def spiking_command(seed: int, processes: int, folder: Path | None, json_path: Path | None) -> None:
    """The posterior that spikes of place cells give, and that by rejection sampling, against the
    exact one.

    Scenes with cues drawn at random: a position by path integration, and the distance to one or two
    walls. A ratio is of standard deviations along x and y, an error is of the mean in exact
    standard deviations.
    """
    with bar("recording") as progress:
        scenes = spiking.measure(seed, processes, progress)

    report_metrics("spiking", spiking.THRESHOLDS, spiking.metrics(scenes), json_path)
    if folder is None:
        return

    from benchmarks.spiking.figure import figure  # matplotlib takes long to import

    for path in save_figure(folder, "spiking", figure(scenes, spiking.seeds(seed))):
        announce(str(path))


benchmarks.add_command(perception_command)
benchmarks.add_command(planning_command)
benchmarks.add_command(explore_command)
benchmarks.add_command(cognition_command)
benchmarks.add_command(memory_command)
benchmarks.add_command(learning_command)
benchmarks.add_command(lifelong_command)
