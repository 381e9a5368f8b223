from __future__ import annotations

import gzip
import lzma
from pathlib import Path

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
    assert extract.nodes == {1: (15.6, 48.4), 2: (15.7, 48.5)}
    assert extract.node_tags == {1: {"name": "Café", "amenity": "cafe"}}
    assert [(way.id, way.nodes, way.tags) for way in extract.ways] == [
        (7, [1, 2, 3], {"highway": "residential"})
    ]


@pytest.mark.parametrize(("suffix", "opener"), [(".xz", lzma.open), (".gz", gzip.open)])
def test_a_packed_extract_reads_as_a_plain_one(tmp_path: Path, suffix: str, opener) -> None:
    path = tmp_path / f"a.osm{suffix}"
    with opener(path, "wt", encoding="utf-8") as file:
        file.write(EXTRACT)
    assert osm.read(path) == osm.read(_write(tmp_path / "a.osm", EXTRACT))


@pytest.mark.parametrize(
    ("wrong", "right", "line", "expected"),
    [
        ('lat="48.5"', 'lat="north"', 4, "a <node> with lat in degrees, from -90 to 90"),
        ('lon="15.7"', 'lon="195.7"', 4, "a <node> with lon in degrees, from -180 to 180"),
        ('lon="15.7"', 'lon="nan"', 4, "a <node> with lon in degrees"),
        ('<nd ref="2"/>', "<nd/>", 5, "a <nd> with a whole number for ref"),
        ("</way>", "", 6, "well-formed XML"),
        ('<osm version="0.6">', '<gpx version="0.6">', 2, "the element <osm>"),
    ],
)
def test_a_wrong_line_is_named_with_what_was_expected(
    tmp_path: Path, wrong: str, right: str, line: int, expected: str
) -> None:
    path = _write(tmp_path / "a.osm", EXTRACT.replace(wrong, right))
    with pytest.raises(UsageError) as caught:
        osm.read(path)
    assert str(caught.value).startswith(f"{path}, line {line}: expected {expected}")


def test_a_file_that_stops_in_the_middle_names_its_last_line(tmp_path: Path) -> None:
    path = _write(tmp_path / "a.osm", "\n".join(EXTRACT.splitlines()[:4]))
    with pytest.raises(UsageError, match="line 4: expected well-formed XML"):
        osm.read(path)


def test_entities_are_refused(tmp_path: Path) -> None:
    bomb = '<?xml version="1.0"?>\n<!DOCTYPE osm [<!ENTITY a "aaaa">]>\n<osm>&a;</osm>\n'
    with pytest.raises(UsageError, match="line 2: expected no entity declarations"):
        osm.read(_write(tmp_path / "a.osm", bomb))


@pytest.mark.parametrize("content", [None, b"no xz at all"])
def test_what_cannot_be_opened_is_one_sentence(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "a.osm.xz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UsageError, match="cannot be read"):
        osm.read(path)


GRAPH = (
    '{"city":"A","nodes_lonlat":[[1.0,2.0],[1.1,2.0]],"edges":[[0,1,9.5,"residential","",null]]}\n'
)


def test_street_graphs_are_read_a_city_a_line(tmp_path: Path) -> None:
    graphs = street_graphs.read(_write(tmp_path / "a.jsonl", GRAPH + GRAPH.replace('"A"', '"B"')))
    assert [graph.city for graph in graphs] == ["A", "B"]
    assert graphs[0].line(graphs[0].edges[0]) == [(1.0, 2.0), (1.1, 2.0)]


@pytest.mark.parametrize(
    ("wrong", "right", "expected"),
    [("[0,1,", "[0,2,", "an edge between two of 2 nodes"), ('"city":"A",', "", "a street graph")],
)
def test_a_wrong_street_graph_is_named_by_its_line(
    tmp_path: Path, wrong: str, right: str, expected: str
) -> None:
    with pytest.raises(UsageError, match=f"line 2: expected {expected}"):
        street_graphs.read(_write(tmp_path / "a.jsonl", GRAPH + GRAPH.replace(wrong, right)))
