"""The table of formats: a sample of each, and the reader that it goes through."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from benchmarks.fuzz import samples
from benchmarks.fuzz.samples import Files, encoded, made
from cogmap.cli import goal
from cogmap.cli.memory import lines
from cogmap.data import (
    human_tours,
    moving_ai,
    mrclam,
    osm,
    plaza,
    pose_graph,
    street_graphs,
    tsplib,
    victoria_park,
)
from cogmap.data.bags.bag import Bag
from cogmap.data.euroc import read_euroc
from cogmap.data.image_folder import read_images
from cogmap.data.kitti import read_kitti
from cogmap.data.stereo_recording import StereoRecording, picture
from cogmap.errors import MessageError
from cogmap.files.digests import write_digests
from cogmap.files.packed import read_arrays
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.recover import recover
from cogmap.runtime import config
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.journal import Journal
from cogmap.runtime.state.published import PublishedCounts
from cogmap.schemas import topics
from cogmap.services import registry
from cogmap.services.epam.public import road

Reader = Callable[[Path], object]


class Format(NamedTuple):
    """A format: the files of a sample, which of them is read, `.` for the folder of all, and by
    what.
    """

    name: str
    sample: Callable[[], Files]
    file: str
    read: Reader


def _log(path: Path) -> None:
    reader = LogReader(path)
    for record in reader.records():
        try:
            reader.message(record)
        except MessageError:
            continue
    reader.payloads([topics.DELTA, topics.VIEW])


def _recover(path: Path) -> None:
    target = path.with_name("saved.mcap")
    target.unlink(missing_ok=True)
    recover(path, target)


def _pairs(read: Callable[[Path], StereoRecording]) -> Reader:
    def reader(path: Path) -> None:
        read(path).pair(0)

    return reader


def _config(path: Path) -> None:
    sections = config.load(path)
    config.check_sections(sections, registry.sections())
    for name in sections:
        config.typed(sections, name, registry.config_type(name))


def _grid(path: Path) -> None:
    is_passable = moving_ai.read_map(path / "a.map")
    moving_ai.read_problems(path / "a.scen", is_passable)


def _tour(path: Path) -> None:
    problem = tsplib.read(path / "a.tsp")
    tsplib.optimal_tour(path, problem)
    tsplib.lengths(problem.positions, problem.weight_type)


def _journal(path: Path) -> None:
    journal = Journal(path)
    try:
        for _ in journal.messages():
            pass
    finally:
        journal.close()


def _database(path: Path) -> None:
    database = Database(path)
    try:
        list(database.records())
    finally:
        database.close()


def _export(path: Path) -> None:
    with path.open("rb") as file:
        head = lines.head(path, file.readline())
        for _ in lines.records(path, file, head.count):
            pass


def _bag(path: Path) -> None:
    bag = Bag(path)
    for topic in bag.topics:
        for _ in bag.unstamped(topic):
            pass


def _weights(path: Path) -> None:
    write_digests(path)
    road.load(path)


def _texts(**files: str) -> Callable[[], Files]:
    named = {name.replace("__", "."): text for name, text in files.items()}
    return lambda: encoded(named)


def _formats() -> Iterator[Format]:
    yield Format("log", lambda: made("a.mcap", samples.log), "a.mcap", _log)
    yield Format("log, recovered", lambda: made("a.mcap", samples.log), "a.mcap", _recover)
    yield Format("osm", _texts(a__osm=samples.OSM), "a.osm", osm.read)
    for suffix, pack in samples.PACKERS.items():
        name = f"a.osm{suffix}"
        packed = {name: pack(samples.OSM.encode())}
        yield Format(f"osm{suffix}", partial(dict, packed), name, osm.read)
    pbf = "a.osm.pbf"
    yield Format("osm.pbf", lambda: made(pbf, samples.protocolbuffer), pbf, osm.read)
    yield Format("streets", _texts(a__jsonl=samples.STREETS), "a.jsonl", street_graphs.read)
    yield Format(
        "tsplib", lambda: encoded({"a.tsp": samples.TSP, "a.opt.tour": samples.TOUR}), ".", _tour
    )
    tours = {"Graph0.lib": samples.TSP, "tours.csv": 'graph,participant,x,y\n0,7,"0,3,3","0,0,4"\n'}
    yield Format("human tours", lambda: encoded(tours), ".", human_tours.read_folder)
    yield Format("g2o", _texts(a__g2o=samples.G2O), "a.g2o", pose_graph.read)
    yield Format("toro", _texts(a__graph=samples.TORO), "a.graph", pose_graph.read)
    yield Format("true poses", _texts(a="0 1 2 3\n1 2 3 4\n"), "a", pose_graph.read_true_positions)
    grid = {"a.map": samples.GRID, "a.scen": samples.ROUTES}
    yield Format("moving ai", lambda: encoded(grid), ".", _grid)
    yield Format("mrclam", lambda: encoded(samples.MRCLAM), ".", mrclam.read)
    yield Format("victoria park", lambda: encoded(samples.TREES), ".", victoria_park.read)
    yield Format("plaza", lambda: encoded(samples.BEACONS), ".", plaza.read)
    yield Format("kitti", samples.kitti, ".", _pairs(read_kitti))
    yield Format("euroc", samples.euroc, ".", _pairs(read_euroc))
    yield Format("images", samples.images, ".", _pairs(read_images))
    for suffix in (".png", ".jpg", ".tif", ".bmp", ".pgm"):
        content = {f"a{suffix}": samples.picture(suffix)}
        yield Format(f"picture{suffix}", partial(dict, content), f"a{suffix}", picture)
    yield Format("settings", _texts(a__toml=samples.SETTINGS), "a.toml", _config)
    yield Format("goals", _texts(goals=samples.GOALS), "goals", goal.read_goals)
    yield Format("journal", lambda: made("journal", samples.journal), "journal", _journal)
    yield Format(
        "counts",
        lambda: made("counts", samples.counts),
        "counts",
        lambda path: PublishedCounts(path).close(),
    )
    yield Format("database", lambda: made("memory", samples.database), "memory", _database)
    yield Format("export", lambda: made("a.jsonl", samples.export), "a.jsonl", _export)
    yield Format("arrays", lambda: made("a.npz", samples.arrays), "a.npz", read_arrays)
    weights = {"road.onnx": road.DEFAULT_PATH.read_bytes()}
    yield Format("weights", lambda: weights, "road.onnx", _weights)
    if find_spec("rosbags"):
        bags = {
            "bag 1": ("a.bag", 1, ""),
            "bag 2": ("a", 2, "MCAP"),
            "bag 2, SQLite": ("a", 2, "SQLITE3"),
        }
        for called, (name, version, plugin) in bags.items():
            make = partial(_bag_of, version, plugin)
            yield Format(called, partial(made, name, make), name, _bag)


def _bag_of(version: int, plugin: str, path: Path) -> None:
    samples.bag(path, version, plugin)


@cache
def formats() -> dict[str, Format]:
    """Return the formats by name, those whose library is installed."""
    return {each.name: each for each in _formats()}
