"""OpenStreetMap extracts, read by libosmium: XML as JOSM, Overpass and the API write it, plain or
packed by gzip, bzip2 or xz, and PBF as Geofabrik distributes it.
"""

from __future__ import annotations

import lzma
from dataclasses import dataclass, field
from pathlib import Path

import osmium
from osmium.osm import Node
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
    """A way: the nodes along it, in order, and its tags."""

    id: int
    nodes: list[int] = field(default_factory=list)
    tags: Tags = field(default_factory=dict)


@dataclass
class Extract:
    """The contents of a file: nodes as (longitude, latitude) in degrees by id, the tags of those
    that have any, and ways.

    A way may name nodes that lie outside the extract.
    """

    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)
    node_tags: dict[int, Tags] = field(default_factory=dict)
    ways: list[Way] = field(default_factory=list)


def read(path: Path) -> Extract:
    """The extract in a file. Raises UsageError naming the file and the element that is wrong, or
    the line where its XML is.
    """
    extract = Extract()
    kinds = osmium.osm.NODE | osmium.osm.WAY
    try:
        for element in osmium.FileProcessor(_source(path), kinds):
            if isinstance(element, Node):
                _add_node(extract, path, element)
            elif isinstance(element, ReadWay):
                _add_way(extract, path, element)
    except _LIBRARY_ERRORS as error:
        raise UsageError(f"{path} cannot be read ({error}): {_REMEDY}") from None
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
