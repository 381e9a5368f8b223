"""Street graphs, a city a line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cogmap.data.street_graphs import read
from cogmap.errors import UsageError

NODES = [[1.0000001, 2.0], [1.001, 2.0], [1.001, 2.001]]


def _file(folder: Path, **facts: object) -> Path:
    path = folder / "cities.jsonl"
    path.write_text(json.dumps({"city": "Town", "nodes_lonlat": NODES, **facts}) + "\n")
    return path


@pytest.mark.parametrize("name", ["edges", "edges_u_v_len_highway_name_geom"])
def test_edges_lead_from_node_to_node_whichever_way_their_polyline_goes(
    tmp_path: Path, name: str
) -> None:
    bend = [[1.001, 2.001], [1.0005, 2.0007], [1.0, 2.0]]
    straight_edge = [0, 1, 100.0, "residential", None, None]
    bent_edge = [0, 2, 150.0, "", None, bend]
    (graph,) = read(_file(tmp_path, **{name: [straight_edge, bent_edge]}))
    first, second, third = [tuple(node) for node in NODES]

    assert graph.line(graph.edges[0]) == [first, second]
    assert graph.line(graph.edges[1]) == [first, (1.0005, 2.0007), third]


@pytest.mark.parametrize(
    ("facts", "expected"),
    [({}, "with edges"), ({"edges": [[0, 7]]}, "3 nodes"), ({"edges": 3}, "array")],
)
def test_a_wrong_line_is_named_with_what_was_expected_there(
    tmp_path: Path, facts: dict[str, object], expected: str
) -> None:
    path = _file(tmp_path, **facts)

    with pytest.raises(UsageError, match=f"cities.jsonl, line 1: expected .*{expected}"):
        read(path)
