"""Street graphs as JSON Lines, plain or packed.

A city a line: `city`, `nodes_lonlat`, and `edges_u_v_len_highway_name_geom`, or `edges` for short,
each of them [from, to, length_m, highway, name, polyline or null].
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import msgspec

from cogmap.data.text import PACKED, numbered_lines
from cogmap.files.bounds import Budget

SUFFIXES = tuple(f".jsonl{packed}" for packed in PACKED)
Lon = Annotated[float, msgspec.Meta(ge=-180, le=180)]
Lat = Annotated[float, msgspec.Meta(ge=-90, le=90)]
_POLYLINE = 5
# A list or a number of JSON takes at most so much memory.
_PART_BYTES = 80


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
        """Return an edge's points in degrees, from its first node to its second, in whichever
        direction its polyline is; the ends are exactly the nodes.
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
    """Read every city in a file. Raises UsageError naming file, line and what was expected."""
    graphs = []
    budget = Budget(path, "takes")
    for line in numbered_lines(path, "street graphs as JSON Lines"):
        if not line.text.strip():
            continue
        budget.check(sum(line.text.count(mark) for mark in "[{,") * _PART_BYTES)
        try:
            graph = msgspec.json.decode(line.text, type=StreetGraph)
        except (msgspec.DecodeError, UnicodeEncodeError, RecursionError) as error:
            raise line.wrong(f"a street graph ({error})") from None

        if not graph.edges:
            raise line.wrong("a street graph with edges")
        count = len(graph.nodes_lonlat)
        for edge in graph.edges:
            ends = edge[:2]
            if len(ends) < 2 or not all(isinstance(end, int) and 0 <= end < count for end in ends):
                wrong = line._replace(text=str(edge))
                raise wrong.wrong(f"an edge between two of {count} nodes, by their numbers")
        graphs.append(graph)

    return graphs
