"""OpenStreetMap extracts, read by libosmium: XML as JOSM, Overpass and the API write it, plain or
packed, and PBF as Geofabrik distributes it.
"""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass, field
from io import BytesIO
from itertools import groupby
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import osmium
from osmium.osm import Node, Relation
from osmium.osm import Way as ReadWay

from cogmap.data.text import PACKED, read_bytes
from cogmap.errors import UsageError
from cogmap.files.bounds import Budget
from cogmap.geometry.geographic import continuous

SUFFIXES = (*(f".osm{packed}" for packed in PACKED), ".osm.pbf")
GIVE = "an OpenStreetMap extract, as PBF or as XML (of Overpass by `(._;>;); out;`)"
# Contents that downloads are mistaken for, by how they begin, and what to do about them.
_FOREIGN = {
    b"{": "it is JSON, ask Overpass for [out:xml]",
    b"<html": "it is a web page such as a server's error, download the extract again",
    b"<!doctype html": "it is a web page such as a server's error, download the extract again",
}
Tags = dict[str, str]
# What an element takes in memory as it is read, what each of its tags, and each node of a way.
ELEMENT_BYTES = 600
TAG_BYTES = 300
REFERENCE_BYTES = 100


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

    Longitudes are beyond 180 east of the 180th meridian if the extract lies on both sides. A way
    may name nodes that lie outside the extract; a multipolygon that is not whole is left out.
    """

    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)
    node_tags: dict[int, Tags] = field(default_factory=dict)
    ways: list[Way] = field(default_factory=list)

    def pieces(self, way: Way) -> list[list[int]]:
        """Return the parts of a way that lie in the extract, each as two nodes at least."""
        runs = groupby(way.nodes, key=self.nodes.__contains__)
        parts = [list(nodes) for is_inside, nodes in runs if is_inside]
        return [part for part in parts if len(part) > 1]


def read(path: Path) -> Extract:
    """Read the extract in a file: of each element the newest version, once, unless it is deleted.

    Raises UsageError naming the file and the element that is wrong, or the line if its XML is, and
    for a download that is not whole.
    """
    content = b""
    source: str | osmium.io.FileBuffer = str(path)
    if path.suffix != ".pbf":
        content = read_bytes(path, GIVE)
        source = osmium.io.FileBuffer(content, "osm")

    found = _Elements(path)
    try:
        for element in osmium.FileProcessor(source):
            if isinstance(element, Node | ReadWay | Relation):
                found.enter(element)
    except (osmium.InvalidLocationError, RuntimeError, ValueError, OSError) as error:
        beginning = content[:100].lstrip().lower()
        remedies = [remedy for start, remedy in _FOREIGN.items() if beginning.startswith(start)]
        raise UsageError(
            f"{path} cannot be read ({error}): {(*remedies, f'give {GIVE}')[0]}"
        ) from None

    _remove_deleted(found, content)
    if found.ways and not found.nodes:
        raise UsageError(f"{path} has ways, but no positions of their nodes: give {GIVE}")

    if found.nodes:
        lonlat = continuous(np.array(list(found.nodes.values())))
        found.nodes = dict(zip(found.nodes, map(tuple, lonlat.tolist()), strict=True))
    rings = [ring for building in found.buildings.values() for ring in building.rings(found.ways)]
    return Extract(found.nodes, found.node_tags, [*found.ways.values(), *rings])


class _Elements:
    """The elements of a file by their ids, each in the newest version that has been read."""

    def __init__(self, path: Path) -> None:
        self.nodes: dict[int, tuple[float, float]] = {}
        self.node_tags: dict[int, Tags] = {}
        self.ways: dict[int, Way] = {}
        self.buildings: dict[int, _Multipolygon] = {}
        self.path = path
        self._versions: dict[str, dict[int, int]] = {"n": {}, "w": {}, "r": {}}
        self._budget = Budget(path, "takes")

    def enter(self, element: Node | ReadWay | Relation) -> None:
        """Enter an element in the place of an older version. Raises UsageError if it is wrong."""
        kind = element.type_str()
        versions = self._versions[kind]
        if element.version < versions.get(element.id, 0):
            return
        versions[element.id] = element.version
        self._budget.take(ELEMENT_BYTES + TAG_BYTES * len(element.tags))
        if element.deleted:
            self.remove(kind, element.id)
        elif isinstance(element, Node):
            if not element.location.valid():
                raise UsageError(
                    f"{self.path}, node {element.id}: expected lon in degrees from -180 to 180 and "
                    "lat from -90 to 90"
                )
            self.nodes[element.id] = (element.lon, element.lat)
            if tags := dict(element.tags):
                self.node_tags[element.id] = tags
        elif isinstance(element, ReadWay):
            self._budget.take(REFERENCE_BYTES * len(element.nodes))
            nodes = [node.ref for node in element.nodes]
            if 0 in nodes:
                raise UsageError(
                    f"{self.path}, way {element.id}: expected a node's id in each <nd>, as ref"
                )
            # Overpass' `out geom` writes the positions of nodes into the ways.
            for node in element.nodes:
                if node.location.valid():
                    self.nodes.setdefault(node.ref, (node.lon, node.lat))
            self.ways[element.id] = Way(element.id, nodes, dict(element.tags))
        elif element.tags.get("type") == "multipolygon" and "building" in element.tags:
            self._budget.take(REFERENCE_BYTES * len(element.members))
            members = [each for each in element.members if each.type == "w"]
            outer = [each.ref for each in members if each.role != "inner"]
            self.buildings[element.id] = _Multipolygon(element.id, outer, dict(element.tags))

    def remove(self, kind: str, identifier: int) -> None:
        """Remove an element that was deleted."""
        of_kind: dict[str, tuple[dict[int, Any], ...]] = {
            "n": (self.nodes, self.node_tags),
            "w": (self.ways,),
            "r": (self.buildings,),
        }
        for elements in of_kind[kind]:
            elements.pop(identifier, None)


def _remove_deleted(found: _Elements, content: bytes) -> None:
    """Remove what JOSM has marked as deleted, which libosmium does not read.

    Raises UsageError if Overpass remarks that it did not finish.
    """
    if b"<remark" not in content and b"action=" not in content:
        return

    for _, element in ElementTree.iterparse(BytesIO(content)):
        if element.tag in ("node", "way", "relation") and element.get("action") == "delete":
            found.remove(element.tag[0], int(element.get("id", 0)))
        if element.tag == "remark" and "error" in (element.text or ""):
            raise UsageError(
                f"{found.path} is not whole, as Overpass remarks ({(element.text or '').strip()}): "
                "ask it for a smaller area, or for less"
            )
        if element.tag not in ("nd", "tag", "member"):
            element.clear()


@dataclass
class _Multipolygon:
    """A relation whose outer rings are made of ways, in any order and direction."""

    id: int
    ways: list[int]
    tags: Tags

    def rings(self, way_of: dict[int, Way]) -> list[Way]:
        """Return the outer rings; none if they are not whole in the extract, or no more than a way
        that is a building itself.
        """
        if not all(way in way_of for way in self.ways):
            return []

        members = [way_of[way] for way in self.ways]
        lines = [way.nodes for way in members if len(way.nodes) > 1 and "building" not in way.tags]
        ending_at: dict[int, deque[int]] = defaultdict(deque)
        for number, line in enumerate(lines):
            for end in (line[0], line[-1]):
                ending_at[end].append(number)

        taken: set[int] = set()
        rings = []
        for number, line in enumerate(lines):
            if number in taken:
                continue
            taken.add(number)
            ring = list(line)
            while ring[0] != ring[-1]:
                candidates = ending_at[ring[-1]]
                while candidates and candidates[0] in taken:
                    candidates.popleft()
                if not candidates:
                    return []

                found = candidates.popleft()
                taken.add(found)
                following = lines[found]
                onward = following if following[0] == ring[-1] else following[::-1]
                ring.extend(onward[1:])
            rings.append(Way(self.id, ring, self.tags))

        return rings
