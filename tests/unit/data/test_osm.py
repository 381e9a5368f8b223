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


def test_what_was_deleted_is_not_there(tmp_path: Path) -> None:
    by_josm = EXTRACT.replace('<way id="7"', '<way id="7" action="delete" visible="true"')
    on_the_server = EXTRACT.replace('<way id="7"', '<way id="7" visible="false"')
    modified = EXTRACT.replace('<way id="7"', '<way id="7" action="modify"')

    assert not osm.read(_write(tmp_path / "a.osm", by_josm)).ways
    assert not osm.read(_write(tmp_path / "b.osm", on_the_server)).ways
    assert len(osm.read(_write(tmp_path / "c.osm", modified)).ways) == 1


def test_of_an_element_that_comes_twice_the_newest_is_there_once(tmp_path: Path) -> None:
    new = '<way id="7" version="2"><nd ref="1"/><nd ref="2"/><tag k="highway" v="service"/></way>'
    old = new.replace('version="2"', 'version="1"').replace("service", "track")
    for number, ways in enumerate((new + old, old + new, new + new)):
        extract = EXTRACT.replace("</osm>", f"{ways}</osm>")
        (way,) = osm.read(_write(tmp_path / f"{number}.osm", extract)).ways
        assert way.tags == {"highway": "service"}


def test_a_way_that_leaves_the_extract_is_in_pieces(tmp_path: Path) -> None:
    extract = osm.read(_write(tmp_path / "a.osm", EXTRACT))
    way = osm.Way(1, [1, 2, 98, 99, 2, 1, 97, 1])

    assert extract.pieces(way) == [[1, 2], [2, 1]]


def test_positions_in_the_ways_are_read_and_missing_ones_named(tmp_path: Path) -> None:
    geom = """<osm version="0.6"><way id="7"><nd ref="1" lat="48.4" lon="15.6"/>
      <nd ref="2" lat="48.5" lon="15.7"/><tag k="highway" v="road"/></way></osm>"""
    body = """<osm version="0.6"><way id="7"><nd ref="1"/><nd ref="2"/></way></osm>"""

    assert osm.read(_write(tmp_path / "a.osm", geom)).nodes == {1: (15.6, 48.4), 2: (15.7, 48.5)}
    with pytest.raises(UsageError, match=r"no positions of their nodes: give .*`\(\._;>;\); out;`"):
        osm.read(_write(tmp_path / "b.osm", body))


def test_longitudes_go_on_across_the_180th_meridian(tmp_path: Path) -> None:
    across = EXTRACT.replace("15.6", "179.75").replace("15.7", "-179.75")

    nodes = osm.read(_write(tmp_path / "a.osm", across)).nodes
    assert nodes == {1: (179.75, 48.4), 2: (180.25, 48.5)}


def test_a_download_that_is_not_whole_is_named_with_its_remark(tmp_path: Path) -> None:
    remark = "<remark> runtime error: Query run out of memory </remark>"
    path = _write(tmp_path / "a.osm", EXTRACT.replace("</osm>", f"{remark}</osm>"))

    with pytest.raises(UsageError, match=r"not whole.*run out of memory\): ask it for a smaller"):
        osm.read(path)


@pytest.mark.parametrize(
    ("content", "remedy"),
    [
        ('{"version":0.6,"elements":[]}', r"it is JSON, ask Overpass for \[out:xml\]"),
        (
            "<html><title>429 Too Many Requests</title></html>",
            "it is a web page .* again",
        ),
    ],
)
def test_a_download_of_another_kind_is_named(tmp_path: Path, content: str, remedy: str) -> None:
    with pytest.raises(UsageError, match=f"cannot be read .*: {remedy}"):
        osm.read(_write(tmp_path / "a.osm", content))


def test_a_packed_extract_is_known_by_its_content(tmp_path: Path) -> None:
    path = tmp_path / "a.osm"
    path.write_bytes(gzip.compress(EXTRACT.encode()))

    assert len(osm.read(path).nodes) == 2


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

    with pytest.raises(
        UsageError, match=r"(cannot be read|there is no file) .*: give an OpenStreetMap"
    ):
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
