"""OpenStreetMap extracts and street graphs, right and wrong."""

from __future__ import annotations

import bz2
import gzip
import lzma
from pathlib import Path

import osmium
import pytest

from cogmap.data import osm, street_graphs
from cogmap.errors import UsageError

EXTRACT = """<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6">
  <node id="1" lat="48.4" lon="15.6"><tag k="name" v="Café"/><tag k="amenity" v="cafe"/></node>
  <node id="2" lat="48.5" lon="15.7"/>
  <way id="7"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="residential"/></way>
</osm>
"""


def _write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_nodes_ways_and_their_tags_are_read(tmp_path: Path) -> None:
    extract = osm.read(_write(tmp_path / "a.osm", EXTRACT))
    (way,) = extract.ways

    assert extract.nodes == {1: (15.6, 48.4), 2: (15.7, 48.5)}
    assert extract.node_tags == {1: {"name": "Café", "amenity": "cafe"}}
    assert way.id == 7
    assert way.nodes == [1, 2, 3]
    assert way.tags == {"highway": "residential"}


MULTIPOLYGON = """<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6">
  <node id="1" lat="48.40" lon="15.60"/>
  <node id="2" lat="48.40" lon="15.61"/>
  <node id="3" lat="48.41" lon="15.61"/>
  <node id="4" lat="48.41" lon="15.60"/>
  <way id="7"><nd ref="1"/><nd ref="2"/><nd ref="3"/></way>
  <way id="8"><nd ref="1"/><nd ref="4"/><nd ref="3"/></way>
  <relation id="5">
    <member type="way" ref="7" role="outer"/>
    <member type="way" ref="8" role="outer"/>
    <tag k="type" v="multipolygon"/><tag k="building" v="school"/>
  </relation>
</osm>
"""


def test_a_building_whose_outline_is_several_ways_is_one(tmp_path: Path) -> None:
    extract = osm.read(_write(tmp_path / "a.osm", MULTIPOLYGON))

    *_, school = extract.ways
    assert school.id == 5
    assert school.tags["building"] == "school"
    assert school.nodes[0] == school.nodes[-1]
    assert set(school.nodes) == {1, 2, 3, 4}


def test_a_multipolygon_that_is_cut_off_is_left_out(tmp_path: Path) -> None:
    cut_off = MULTIPOLYGON.replace('<way id="8"><nd ref="1"/><nd ref="4"/><nd ref="3"/></way>', "")
    extract = osm.read(_write(tmp_path / "a.osm", cut_off))

    assert [way.id for way in extract.ways] == [7]


@pytest.mark.parametrize(
    ("suffix", "opener"), [(".xz", lzma.open), (".gz", gzip.open), (".bz2", bz2.open)]
)
def test_a_packed_extract_reads_as_a_plain_one(tmp_path: Path, suffix: str, opener) -> None:
    plain = _write(tmp_path / "a.osm", EXTRACT)
    packed = tmp_path / f"a.osm{suffix}"
    with opener(packed, "wt", encoding="utf-8") as file:
        file.write(EXTRACT)

    assert osm.read(packed) == osm.read(plain)


def _converted(xml: Path, path: Path) -> Path:
    """The extract in the format that the name of the new file has."""
    with osmium.SimpleWriter(path) as writer:
        for element in osmium.FileProcessor(xml):
            writer.add(element)
    return path


def test_a_pbf_extract_reads_as_an_xml_one(tmp_path: Path) -> None:
    xml = _write(tmp_path / "a.osm", EXTRACT)
    pbf = _converted(xml, tmp_path / "a.osm.pbf")

    assert osm.read(pbf) == osm.read(xml)


@pytest.mark.parametrize(
    ("wrong", "right", "expected"),
    [
        ('lat="48.5"', 'lat="north"', "cannot be read (wrong format for coordinate: 'north')"),
        ('lon="15.7"', 'lon="nan"', "cannot be read (wrong format for coordinate: 'nan')"),
        ('lon="15.7"', 'lon="195.7"', "node 2: expected lon in degrees from -180 to 180"),
        (' lat="48.5" lon="15.7"', "", "node 2: expected lon in degrees from -180 to 180"),
        ('<nd ref="2"/>', "<nd/>", "way 7: expected a node's id in each <nd>"),
        ('<nd ref="2"/>', '<nd ref="x"/>', "cannot be read (illegal id: 'x')"),
        ("</way>", "", "cannot be read (XML parsing error at line 6, column 2"),
        ('<osm version="0.6">', '<gpx version="0.6">', "Unknown top-level element: gpx"),
    ],
)
def test_what_is_wrong_in_an_extract_is_named(
    tmp_path: Path, wrong: str, right: str, expected: str
) -> None:
    path = _write(tmp_path / "a.osm", EXTRACT.replace(wrong, right))

    with pytest.raises(UsageError) as caught:
        osm.read(path)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}")
    assert expected in sentence


def test_an_extract_that_stops_in_the_middle_names_its_last_line(tmp_path: Path) -> None:
    first_lines = EXTRACT.splitlines()[:4]
    path = _write(tmp_path / "a.osm", "\n".join(first_lines))

    with pytest.raises(UsageError, match="error at line 4"):
        osm.read(path)


def test_entities_are_refused(tmp_path: Path) -> None:
    bomb = '<?xml version="1.0"?>\n<!DOCTYPE osm [<!ENTITY a "aaaa">]>\n<osm>&a;</osm>\n'

    with pytest.raises(UsageError, match="XML entities are not supported"):
        osm.read(_write(tmp_path / "a.osm", bomb))


@pytest.mark.parametrize("suffix", [".osm", ".osm.gz", ".osm.bz2", ".osm.xz", ".osm.pbf"])
@pytest.mark.parametrize("content", [None, b"", b"no extract at all"])
def test_what_is_no_extract_is_one_sentence(
    tmp_path: Path, content: bytes | None, suffix: str
) -> None:
    path = tmp_path / f"a{suffix}"
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(UsageError, match=r"cannot be read .*: give an OpenStreetMap extract"):
        osm.read(path)


@pytest.mark.parametrize("name", ["a.osm.gz", "a.osm.pbf"])
def test_an_extract_that_was_cut_off_is_one_sentence(tmp_path: Path, name: str) -> None:
    path = _converted(_write(tmp_path / "a.osm", EXTRACT), tmp_path / name)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])

    with pytest.raises(UsageError, match="cannot be read"):
        osm.read(path)


GRAPH = (
    '{"city":"A","nodes_lonlat":[[1.0,2.0],[1.1,2.0]],"edges":[[0,1,9.5,"residential","",null]]}\n'
)


def test_street_graphs_are_read_a_city_a_line(tmp_path: Path) -> None:
    of_b = GRAPH.replace('"A"', '"B"')
    first, second = street_graphs.read(_write(tmp_path / "a.jsonl", GRAPH + of_b))

    assert first.city == "A"
    assert second.city == "B"
    assert first.line(first.edges[0]) == [(1.0, 2.0), (1.1, 2.0)]


@pytest.mark.parametrize(
    ("wrong", "right", "expected"),
    [("[0,1,", "[0,2,", "an edge between two of 2 nodes"), ('"city":"A",', "", "a street graph")],
)
def test_a_wrong_street_graph_is_named_by_its_line(
    tmp_path: Path, wrong: str, right: str, expected: str
) -> None:
    second = GRAPH.replace(wrong, right)
    path = _write(tmp_path / "a.jsonl", GRAPH + second)

    with pytest.raises(UsageError, match=f"line 2: expected {expected}"):
        street_graphs.read(path)
