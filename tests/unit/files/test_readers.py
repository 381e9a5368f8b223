"""Readers believe no number that a file of a few bytes promises."""

from __future__ import annotations

import bz2
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import cv2
import lz4.frame
import numpy as np
import pytest
import zstandard

from cogmap.cli.goal import read_goals
from cogmap.data import moving_ai, osm, street_graphs, tsplib
from cogmap.data.bags import unpacking
from cogmap.data.stereo_recording import picture
from cogmap.errors import BoundError, StorageError, UsageError
from cogmap.files.bounds import VARIABLE
from cogmap.runtime.state.journal import HEAD, Journal
from cogmap.runtime.state.published import PublishedCounts
from cogmap.schemas import topics


def test_a_picture_of_a_gigabyte_of_pixels_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(cv2.imencode(".png", np.zeros((8000, 8000), np.uint8))[1].tobytes())

    with pytest.raises(BoundError, match=r"a\.png has more than 33554432 pixels"):
        picture(path)


def test_a_picture_of_a_chunk_of_four_gigabytes_never_reaches_the_decoder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = bytearray(cv2.imencode(".png", np.zeros((40, 60), np.uint8))[1].tobytes())
    path = tmp_path / "a.png"
    path.write_bytes(content)
    assert picture(path).shape == (40, 60)

    at = content.index(b"IDAT")
    content[at - 4 : at] = b"\xff" * 4
    path.write_bytes(content)
    monkeypatch.setattr(cv2, "imdecode", lambda *arguments: pytest.fail("it makes room for all"))
    with pytest.raises(UsageError, match=r"a\.png"):
        picture(path)


def test_a_grid_map_takes_the_rows_that_are_there(tmp_path: Path) -> None:
    path = tmp_path / "a.map"
    path.write_text("type octile\nheight 16384\nwidth 16384\nmap\n" + "." * 16384 + "\n")

    with pytest.raises(UsageError, match="ends before row 2 of 16384"):
        moving_ai.read_map(path)


def test_a_problem_whose_lengths_fill_the_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes = "".join(f"{number} {number} 0\n" for number in range(1, 301))
    path = tmp_path / "a.tsp"
    head = "DIMENSION : 300\nEDGE_WEIGHT_TYPE : EUC_2D\nNODE_COORD_SECTION\n"
    path.write_text(f"{head}{nodes}EOF\n")
    assert len(tsplib.read(path)) == 300

    monkeypatch.setenv(VARIABLE, "1")
    with pytest.raises(BoundError, match=r"a\.tsp takes, with the lengths between its nodes"):
        tsplib.read(path)


@pytest.mark.parametrize("text", ["[" * 100_000, '{"city": ' + "[" * 100_000])
def test_street_graphs_nested_without_end_are_none(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.jsonl"
    path.write_text(text)

    with pytest.raises(UsageError, match="a street graph"):
        street_graphs.read(path)


def test_goals_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "goals"
    path.write_bytes(b"\x1f\x8b\x00")

    with pytest.raises(UsageError, match="goals, one a line"):
        read_goals(path)


def test_counts_of_one_topic_twice_are_damaged(tmp_path: Path) -> None:
    path = tmp_path / "counts"
    counts = PublishedCounts(path)
    counts.add(topics.DELTA)
    counts.close()
    path.write_bytes(path.read_bytes() * 2)

    with pytest.raises(StorageError, match="damaged"):
        PublishedCounts(path)


def test_a_record_of_four_gigabytes_ends_a_journal(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    path.write_bytes(HEAD.pack(2**32 - 1, 0, 5))

    journal = Journal(path)
    assert not list(journal.messages())
    journal.close()


def test_a_building_of_many_ways_is_joined_from_any_order(tmp_path: Path) -> None:
    ways = 3000
    nodes = "".join(f'<node id="{each}" lat="48.4" lon="15.6"/>' for each in range(1, ways + 1))
    parts = "".join(
        f'<way id="{each}"><nd ref="{each}"/><nd ref="{each % ways + 1}"/></way>'
        for each in range(1, ways + 1)
    )
    members = "".join(
        f'<member type="way" ref="{each}" role="outer"/>' for each in range(ways, 0, -1)
    )
    tags = '<tag k="type" v="multipolygon"/><tag k="building" v="yes"/>'
    path = tmp_path / "a.osm"
    relation = f'<relation id="5">{members}{tags}</relation>'
    path.write_text(f'<osm version="0.6">{nodes}{parts}{relation}</osm>')

    (ring,) = [way for way in osm.read(path).ways if way.id == 5 and way.tags]
    assert len(ring.nodes) == ways + 1
    assert ring.nodes[0] == ring.nodes[-1]


def test_an_extract_of_more_elements_than_the_memory_has_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes = "".join(f'<node id="{each}" lat="48.4" lon="15.6"/>' for each in range(1, 3001))
    path = tmp_path / "a.osm"
    path.write_text(f'<osm version="0.6">{nodes}</osm>')
    assert len(osm.read(path).nodes) == 3000

    monkeypatch.setenv(VARIABLE, "1")
    with pytest.raises(BoundError, match=r"a\.osm takes more than 1 MiB"):
        osm.read(path)


UNPACKERS = [
    (bz2.compress, unpacking.unpacked_bz2),
    (lz4.frame.compress, unpacking.unpacked_lz4),
    (zstandard.compress, unpacking.unpacked_zstd),
]


@pytest.mark.parametrize(("pack", "unpacked"), UNPACKERS)
def test_what_a_bag_has_packed_is_unpacked_up_to_its_bound(
    pack: Callable[[bytes], bytes],
    unpacked: Callable[[bytes], bytes],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(VARIABLE, "1")
    assert unpacked(pack(bytes(1 << 20))) == bytes(1 << 20)

    with pytest.raises(BoundError, match="a chunk unpacks to more than 1 MiB"):
        unpacked(pack(bytes((1 << 20) + 1)))


def test_the_library_of_bags_unpacks_through_these_bounds() -> None:
    reader1 = pytest.importorskip("rosbags.rosbag1.reader")
    reader2 = pytest.importorskip("rosbags.rosbag2.reader")
    storage = pytest.importorskip("rosbags.rosbag2.storage_mcap")
    assert {"bz2", "lz4"} <= reader1.decompressors.keys()
    assert {"lz4", "zstd"} <= storage.DECOMPRESSORS.keys()
    assert {"decompress", "open"} <= set(dir(reader2.zstd))

    unpacking.bound(reader1, reader2, storage)

    assert reader1.decompressors["bz2"] is unpacking.unpacked_bz2
    assert storage.DECOMPRESSORS["zstd"] is unpacking.unpacked_zstd
    assert reader2.zstd.decompress is unpacking.unpacked_zstd


def test_a_database_of_a_bag_with_a_view_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE topics (id INTEGER PRIMARY KEY)")
        connection.commit()
        unpacking.check_databases(path)
        connection.execute("CREATE VIEW messages AS SELECT 1")
        connection.commit()

    with pytest.raises(UsageError, match="view 'messages'"):
        unpacking.check_databases(tmp_path)


def test_metadata_of_a_bag_that_are_nested_without_end_are_refused(tmp_path: Path) -> None:
    metadata = tmp_path / "metadata.yaml"
    metadata.write_text("rosbag2_bagfile_information: {version: 9, files: [{path: a.mcap}]}\n")
    unpacking.check_metadata(tmp_path)
    metadata.write_text("custom_data: " + "[" * 20_000)

    with pytest.raises(UsageError, match="nested more than 64 deep"):
        unpacking.check_metadata(tmp_path)
