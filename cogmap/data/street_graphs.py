"""Street graphs as JSON Lines, plain or packed by gzip, bzip2 or xz.

A city a line: `city`, `nodes_lonlat`, and `edges_u_v_len_highway_name_geom`, or `edges` for short,
each of them [from, to, length_m, highway, name, polyline or null].
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import msgspec

from cogmap.data.lines import wrong_line
from cogmap.data.packed import lines

SUFFIXES = (".jsonl", ".jsonl.gz", ".jsonl.xz", ".jsonl.bz2")
Lon = Annotated[float, msgspec.Meta(ge=-180, le=180)]
Lat = Annotated[float, msgspec.Meta(ge=-90, le=90)]
_POLYLINE = 5


class StreetGraph(msgspec.Struct):
    """A city's streets: nodes as (longitude, latitude) in degrees, edges between two of them by
    their numbers.
    """

    city: str
    nodes_lonlat: list[tuple[Lon, Lat]]
    edges: list[list[Any]] = []
    edges_u_v_len_highway_name_geom: list[list[Any]] = []

    def __post_init__(self) -> None:
        self.edges = self.edges or self.edges_u_v_len_highway_name_geom

    def line(self, edge: list[Any]) -> list[tuple[float, float]]:
        """An edge's points in degrees, from its first node to its second, whichever direction its
        polyline has; the ends are exactly the nodes.
        """
        start = self.nodes_lonlat[edge[0]]
        end = self.nodes_lonlat[edge[1]]
        polyline = edge[_POLYLINE] if len(edge) > _POLYLINE else None
        if not polyline:
            return [start, end]

        points = [(float(lon), float(lat)) for lon, lat in polyline]
        to_first = math.dist(points[0], start)
        to_last = math.dist(points[-1], start)
        if to_first > to_last:
            points.reverse()

        inner = points[1:-1]
        return [start, *inner, end]


def read(path: Path) -> list[StreetGraph]:
    """Every city in a file. Raises UsageError naming file, line and what was expected there."""
    graphs = []
    for number, line in enumerate(lines(path, "street graphs as JSON Lines"), start=1):
        text = line.decode("utf-8", "replace")
        if text.strip():
            graphs.append(_graph(path, number, text))
    return graphs


def _graph(path: Path, number: int, line: str) -> StreetGraph:
    try:
        graph = msgspec.json.decode(line, type=StreetGraph)
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise wrong_line(path, number, line, f"a street graph ({error})") from None

    if not graph.edges:
        raise wrong_line(path, number, line, "a street graph with edges")
    count = len(graph.nodes_lonlat)
    for edge in graph.edges:
        if not _is_edge(edge, count):
            expected = f"an edge between two of {count} nodes, by their numbers"
            raise wrong_line(path, number, str(edge), expected)
    return graph


def _is_edge(edge: list[Any], nodes: int) -> bool:
    """Whether an edge begins with the numbers of two of the `nodes`."""
    ends = edge[:2]
    if len(ends) < 2:
        return False
    return all(isinstance(end, int) and 0 <= end < nodes for end in ends)
