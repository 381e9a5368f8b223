"""OpenStreetMap extracts: XML as JOSM, Overpass and the API write it, plain or packed by gzip,
bzip2 or xz.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from cogmap.data.lines import wrong_line
from cogmap.data.packed import lines

SUFFIXES = (".osm", ".osm.gz", ".osm.xz", ".osm.bz2")

Tags = dict[str, str]


@dataclass
class Way:
    """A way: the nodes that it leads over, in order, and what it is said to be."""

    id: int
    nodes: list[int] = field(default_factory=list)
    tags: Tags = field(default_factory=dict)


@dataclass
class Extract:
    """What is in a file: nodes as (longitude, latitude) in degrees by id, the tags of those that
    have some, ways.

    A way may name nodes that the extract cuts off.
    """

    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)
    node_tags: dict[int, Tags] = field(default_factory=dict)
    ways: list[Way] = field(default_factory=list)


class _WrongError(Exception):
    """What was expected where the parser stands."""


class _Reader:
    """Takes elements as they come; raises _WrongError where one is not what OSM XML has there."""

    def __init__(self) -> None:
        self.extract = Extract()
        self._depth = 0
        self._node: int | None = None
        self._way: Way | None = None

    def start(self, name: str, has: Tags) -> None:
        if self._depth == 0 and name != "osm":
            raise _WrongError("the element <osm>, the root of OpenStreetMap XML")
        self._depth += 1
        if name == "node":
            self._node = _whole(has, "node", "id")
            self.extract.nodes[self._node] = (
                _degrees(has, "lon", 180.0),
                _degrees(has, "lat", 90.0),
            )
        elif name == "way":
            self._way = Way(_whole(has, "way", "id"))
        elif name == "nd" and self._way is not None:
            self._way.nodes.append(_whole(has, "nd", "ref"))
        elif name == "tag":
            self._tag(has)

    def _tag(self, has: Tags) -> None:
        if "k" not in has or "v" not in has:
            raise _WrongError("a <tag> with k and v")
        if self._way is not None:
            self._way.tags[has["k"]] = has["v"]
        elif self._node is not None:
            self.extract.node_tags.setdefault(self._node, {})[has["k"]] = has["v"]

    def end(self, name: str) -> None:
        self._depth -= 1
        if name == "node":
            self._node = None
        elif name == "way" and self._way is not None:
            self.extract.ways.append(self._way)
            self._way = None


def read(path: Path) -> Extract:
    """The extract in a file. Raises UsageError that names file, line and what was expected there."""
    reader = _Reader()
    parser = expat.ParserCreate()
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.EntityDeclHandler = _refuse_entities
    number = 1
    line = b""
    try:
        for read_so_far, line in enumerate(lines(path, "an OpenStreetMap extract"), start=1):
            number = read_so_far
            parser.Parse(line, False)
        parser.Parse(b"", True)
    except _WrongError as error:
        raise wrong_line(path, number, _text(line), str(error)) from None
    except expat.ExpatError as error:
        expected = f"well-formed XML ({expat.ErrorString(error.code)})"
        raise wrong_line(path, number, _text(line), expected) from None
    return reader.extract


def _refuse_entities(*declared: object) -> None:
    raise _WrongError("no entity declarations")


def _text(line: bytes) -> str:
    return line.decode("utf-8", "replace")


def _whole(has: Tags, element: str, name: str) -> int:
    try:
        return int(has[name])
    except (KeyError, ValueError):
        raise _WrongError(f"a <{element}> with a whole number for {name}") from None


def _degrees(has: Tags, name: str, most: float) -> float:
    try:
        value = float(has[name])
    except (KeyError, ValueError):
        value = most + 1
    if not -most <= value <= most:
        raise _WrongError(f"a <node> with {name} in degrees, from {-most:g} to {most:g}")
    return value
