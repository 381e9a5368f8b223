"""OpenStreetMap extracts, read by libosmium: XML as JOSM, Overpass and the API write it, plain or
packed by gzip, bzip2 or xz, and PBF as Geofabrik distributes it.
"""

from __future__ import annotations

import lzma
from dataclasses import dataclass, field
from pathlib import Path

import osmium
from osmium.osm import Node, Relation
from osmium.osm import Way as ReadWay

from cogmap.errors import UsageError

SUFFIXES = (".osm", ".osm.gz", ".osm.xz", ".osm.bz2", ".osm.pbf")
_REMEDY = "give an OpenStreetMap extract, as XML (plain or packed) or as PBF"
_LIBRARY_ERRORS = (
    osmium.InvalidLocationError,
    RuntimeError,
    ValueError,
    OSError,
    EOFError,
    lzma.LZMAError,
)
Tags = dict[str, str]


@dataclass
class Way:
    """A way: the nodes along it, in order, and its tags. Or an outer ring of a building that is a
    multipolygon, with the id and the tags of that relation.
    """

    id: int
    nodes: list[int] = field(default_factory=list)
    tags: Tags = field(default_factory=dict)


@dataclass
class Extract:
    """The contents of a file: nodes as (longitude, latitude) in degrees by id, the tags of those
    that have any, and ways.

    A way may name nodes that lie outside the extract; a multipolygon that is not whole is left out.
    """

    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)
    node_tags: dict[int, Tags] = field(default_factory=dict)
    ways: list[Way] = field(default_factory=list)


def read(path: Path) -> Extract:
    """The extract in a file. Raises UsageError naming the file and the element that is wrong, or
    the line where its XML is.
    """
    extract = Extract()
    buildings = []
    try:
        for element in osmium.FileProcessor(_source(path)):
            if isinstance(element, Node):
                _add_node(extract, path, element)
            elif isinstance(element, ReadWay):
                _add_way(extract, path, element)
            elif isinstance(element, Relation) and _is_building(element):
                buildings.append(_outlined(element))
    except _LIBRARY_ERRORS as error:
        raise UsageError(f"{path} cannot be read ({error}): {_REMEDY}") from None

    way_of = {way.id: way for way in extract.ways}
    for building in buildings:
        extract.ways.extend(_rings(building, way_of))
    return extract


def _source(path: Path) -> str | osmium.io.FileBuffer:
    """What libosmium reads: the file, or its content where that is packed as it does not know."""
    if path.suffix != ".xz":
        return str(path)
    content = lzma.decompress(path.read_bytes())
    return osmium.io.FileBuffer(content, "osm")


def _add_node(extract: Extract, path: Path, node: Node) -> None:
    if not node.location.valid():
        raise UsageError(
            f"{path}, node {node.id}: expected lon in degrees from -180 to 180 and lat from -90 "
            "to 90"
        )
    extract.nodes[node.id] = (node.lon, node.lat)
    tags = dict(node.tags)
    if tags:
        extract.node_tags[node.id] = tags


def _add_way(extract: Extract, path: Path, way: ReadWay) -> None:
    nodes = [node.ref for node in way.nodes]
    if 0 in nodes:
        raise UsageError(f"{path}, way {way.id}: expected a node's id in each <nd>, as ref")

    tags = dict(way.tags)
    extract.ways.append(Way(way.id, nodes, tags))


@dataclass
class _Multipolygon:
    """A relation whose outer rings are made of ways, in any order and direction."""

    id: int
    ways: list[int]
    tags: Tags


def _is_building(relation: Relation) -> bool:
    tags = relation.tags
    return tags.get("type") == "multipolygon" and "building" in tags


def _outlined(relation: Relation) -> _Multipolygon:
    members = [each for each in relation.members if each.type == "w" and each.role != "inner"]
    return _Multipolygon(relation.id, [each.ref for each in members], dict(relation.tags))


def _rings(outlined: _Multipolygon, way_of: dict[int, Way]) -> list[Way]:
    """The outer rings of a multipolygon, none where it is not whole in the extract, or no more than
    a way that is a building itself.
    """
    if not all(way in way_of for way in outlined.ways):
        return []

    members = [way_of[way] for way in outlined.ways]
    lines = [way.nodes for way in members if len(way.nodes) > 1 and "building" not in way.tags]
    rings = []
    while lines:
        ring = _joined(lines)
        if ring[0] != ring[-1]:
            return []
        rings.append(Way(outlined.id, ring, outlined.tags))

    return rings


def _joined(lines: list[list[int]]) -> list[int]:
    """The first of lines of nodes with those that continue it, which are taken from `lines`."""
    joined = list(lines.pop(0))
    while joined[0] != joined[-1]:
        following = next((line for line in lines if joined[-1] in (line[0], line[-1])), None)
        if following is None:
            return joined

        lines.remove(following)
        onward = following if following[0] == joined[-1] else following[::-1]
        joined.extend(onward[1:])

    return joined
