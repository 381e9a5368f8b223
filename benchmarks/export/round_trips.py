"""What of a log is lost on the way through another format: messages that are missing or differ."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap.reader import make_reader

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.pairs import PairRecording, read_pairs
from cogmap.data.bags.topics import Topics
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.recording.exporting import rerun as entities
from cogmap.recording.exporting.tables import flat
from cogmap.recording.log import Log
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Odometry, StereoFrame, TruePose, View
from cogmap.schemas.topics import BY_NAME, Topic

if TYPE_CHECKING:
    import pyarrow

SAME = 1e-6
"""Speeds, in m/s and rad/s, that differ by less are the same: a bag has poses, not speeds."""


def lost_in_csv(log: Log, folder: Path) -> int:
    """Count the rows that are missing in the tables in `folder`, or differ."""
    from pyarrow import csv

    def read(path: Path, expected: pyarrow.Table) -> pyarrow.Table:
        types = {field.name: field.type for field in expected.schema}
        return csv.read_csv(
            path,
            parse_options=csv.ParseOptions(newlines_in_values=True),
            convert_options=csv.ConvertOptions(
                column_types=types, strings_can_be_null=True, quoted_strings_can_be_null=False
            ),
        )

    small = [topic for topic in _topics(log) if not topic.carries_images]
    return sum(_lost_rows(flat(log.frame(topic)), folder, topic, read) for topic in small)


def lost_in_parquet(log: Log, folder: Path) -> int:
    """Count the rows that are missing in the tables in `folder`, or differ."""
    from pyarrow import parquet

    def read(path: Path, expected: pyarrow.Table) -> pyarrow.Table:
        return parquet.read_table(path)

    return sum(_lost_rows(log.frame(topic), folder, topic, read) for topic in _topics(log))


def lost_in_foxglove(log: Log, path: Path) -> int:
    """Count the views whose depth, and the true poses that, are missing in the file, or differ.

    Colours are left out: they are compressed with a loss.
    """
    from mcap_protobuf.decoder import DecoderFactory

    found = defaultdict(list)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages(topics=["/depth", "/truth"]):
            found[channel.topic].append(message)

    depths = [(view.depth_m.shape, bytes(view.depth_m.data)) for view in _all(log, View)]
    images = [((image.height, image.width), image.data) for image in found["/depth"]]
    places_m = [tuple(place) for place in _true_places_m(log).tolist()]
    points = [truth.pose.position for truth in found["/truth"]]
    shown_m = [(point.x, point.y) for point in points]
    return _differing(depths, images) + _differing(places_m, shown_m)


def lost_in_rerun(log: Log, path: Path) -> int:
    """Count the views whose depth, and the true poses that, are missing in the file, or differ."""
    from rerun.chunk import RrdReader

    depths: list[bytes] = []
    places_m: list[tuple[float, float]] = []
    for chunk in RrdReader(path).stream():
        rows = chunk.to_record_batch()
        match chunk.entity_path.removeprefix("/"):
            case entities.DEPTH:
                buffers = rows.column("DepthImage:buffer")
                depths += [buffer.values[0].values.to_numpy().tobytes() for buffer in buffers]
            case entities.TRUTH:
                (places,) = zip(*rows.column("Transform3D:translation").to_pylist(), strict=True)
                places_m += [(x_m, y_m) for x_m, y_m, _ in places]

    seen = [bytes(view.depth_m.data) for view in _all(log, View)]
    true_m = [(float(x), float(y)) for x, y in _true_places_m(log).astype(np.float32)]
    return _differing(seen, depths) + _differing(true_m, places_m)


def lost_in_bag(log: Log, folder: Path) -> int:
    """Count the pairs of images, and the motions of the wheels, that are missing in the bag in
    `folder`, or differ, as a recording that is played.
    """
    frames = list({frame.stamp_ns: frame for frame in _all(log, StereoFrame)}.values())
    bag = read_pairs(Bag(folder), Topics())
    begin_ns = int(bag.stamps_ns[0]) - frames[0].stamp_ns
    pairs = [(frame.stamp_ns, frame.left, frame.right) for frame in frames]
    lost = _differing(pairs, list(_pairs(bag, begin_ns)))
    return lost + _lost_motions(bag, begin_ns, log)


def _pairs(bag: PairRecording, begin_ns: int) -> Iterator[tuple[int, Array, Array]]:
    """Yield the pairs of a bag that can be read."""
    for number, stamp_ns in enumerate(bag.stamps_ns.tolist()):
        try:
            left, right = bag.pair(number)
        except UsageError:
            continue
        yield stamp_ns - begin_ns, Array.of(left), Array.of(right)


def _lost_motions(bag: PairRecording, begin_ns: int, log: Log) -> int:
    if bag.motions is None:
        return len(list(_all(log, Odometry)))

    speeds = dict(zip((bag.motions.stamps_ns - begin_ns).tolist(), bag.motions.rows, strict=True))
    lost = 0
    for moved in _all(log, Odometry):
        row = speeds.get(moved.stamp_ns, np.full(3, np.inf))
        errors = np.abs(row[:2] - (moved.speed_m_s, moved.turn_rate_rad_s))
        lost += bool(errors.max() > SAME)
    return lost


def _all(log: Log, kind: type) -> Iterator[Any]:
    for entry in log.messages(topics.BY_TYPE[kind]):
        yield entry.message


def _true_places_m(log: Log) -> Floats:
    """Return where the robot truly was, (n, 2)."""
    places_m = [(true.pose.x_m, true.pose.y_m) for true in _all(log, TruePose)]
    return np.array(places_m).reshape(-1, 2)


def _topics(log: Log) -> list[Topic]:
    return [BY_NAME[name] for name in log.topics]


def _lost_rows(
    expected: pyarrow.Table,
    folder: Path,
    topic: Topic,
    read: Callable[[Path, pyarrow.Table], pyarrow.Table],
) -> int:
    if not expected.num_rows:
        return 0
    path = next(folder.glob(f"{topic.file_stem}.*"), None)
    if path is None:
        return int(expected.num_rows)
    found = read(path, expected)
    return _differing(expected.to_pylist(), found.to_pylist())


def _differing(expected: list[Any], found: list[Any]) -> int:
    """Count the places at which two lists differ, those at which one has ended among them."""
    return sum(one != other for one, other in zip_longest(expected, found))
