"""Street graphs as JSON Lines, plain or packed by gzip, bzip2 or xz.

A city a line: `city`, `nodes_lonlat`, and `edges` as [from, to, length_m, highway, name, polyline or null].
"""

from __future__ import annotations

import bz2
import gzip
import lzma
from pathlib import Path
from typing import Annotated, Any

import msgspec

from bus.errors import UsageError
from datasets.lines import wrong_line

SUFFIXES = (".jsonl", ".jsonl.gz", ".jsonl.xz", ".jsonl.bz2")
_OPENERS = {".gz": gzip.open, ".xz": lzma.open, ".bz2": bz2.open}
Lon = Annotated[float, msgspec.Meta(ge=-180, le=180)]
Lat = Annotated[float, msgspec.Meta(ge=-90, le=90)]


class StreetGraph(msgspec.Struct):
    """A city's streets: nodes as (longitude, latitude) in degrees, edges between two of them by their numbers."""

    city: str
    nodes_lonlat: list[tuple[Lon, Lat]]
    edges: list[list[Any]]

    def line(self, edge: list[Any]) -> list[tuple[float, float]]:
        """An edge's points in degrees."""
        polyline = edge[5] if len(edge) > 5 and edge[5] else None
        ends = [self.nodes_lonlat[edge[0]], self.nodes_lonlat[edge[1]]]
        return ends if polyline is None else [(float(lon), float(lat)) for lon, lat in polyline]


def read(path: Path) -> list[StreetGraph]:
    """Every city in a file. Raises UsageError that names file, line and what was expected there."""
    opener = _OPENERS.get(path.suffix, open)
    graphs = []
    try:
        with opener(path, "rt", encoding="utf-8") as file:
            for number, line in enumerate(file, start=1):
                if line.strip():
                    graphs.append(_graph(path, number, line))
    except (OSError, EOFError, lzma.LZMAError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read ({error}): give street graphs as JSON Lines") from error
    return graphs


def _graph(path: Path, number: int, line: str) -> StreetGraph:
    try:
        graph = msgspec.json.decode(line, type=StreetGraph)
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise wrong_line(path, number, line, f"a street graph ({error})") from None
    count = len(graph.nodes_lonlat)
    for edge in graph.edges:
        if len(edge) < 2 or not all(isinstance(end, int) and 0 <= end < count for end in edge[:2]):
            raise wrong_line(path, number, str(edge), f"an edge between two of {count} nodes, by their numbers")
    return graph
