"""Messages as people and other programs read them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Delta, DropNode, Phase
from cogmap.schemas.nodes import Node
from cogmap.schemas.render import field, to_jsonable, to_text

DELTA = Delta(
    stamp_ns=5,
    source="workspace",
    version=1,
    cycle=2,
    phase=Phase.OBJECTS,
    tasks=[],
    operations=[
        Node(
            id="self",
            kind="thing",
            attributes={"x_m": 1.5},
            samples=Matrix.of(np.arange(6.0).reshape(3, 2)),
        ),
        DropNode(id="tree"),
    ],
)


def test_json_abbreviates_arrays_and_names_the_kind_of_each_operation() -> None:
    shown = json.loads(json.dumps(to_jsonable(DELTA)))
    node, drop = shown["operations"]

    assert node["type"] == "node"
    assert node["attributes"] == {"x_m": 1.5}
    assert node["samples"] == {"dtype": "<f8", "shape": [3, 2], "min": 0.0, "max": 5.0}
    assert drop == {"type": "drop_node", "id": "tree"}


def test_full_json_has_every_value() -> None:
    assert to_jsonable(DELTA, full=True)["operations"][0]["samples"]["data"] == [
        [0, 1],
        [2, 3],
        [4, 5],
    ]


def test_an_empty_array_has_no_least_value() -> None:
    empty = Array.of(np.zeros((0, 2)))

    assert to_jsonable(empty)["min"] is None


def test_text_is_yaml_with_a_line_a_field() -> None:
    assert to_text(DELTA).splitlines() == [
        "stamp_ns: 5",
        "seq: 0",
        "source: workspace",
        "version: 1",
        "cycle: 2",
        "phase: objects",
        "tasks: []",
        "operations:",
        "- type: node",
        "  id: self",
        "  activation: 0.0",
        "  base_level: 0.0",
        "  cycle: 0",
        "  salience: 0.0",
        "  kind: thing",
        "  attributes:",
        "    x_m: 1.5",
        "  samples: <f8 3 x 2, 0.0 to 5.0",
        "- type: drop_node",
        "  id: tree",
        "rejected: 0",
        "reasons: []",
    ]


def test_a_path_leads_into_structs_lists_dicts_and_arrays() -> None:
    assert field(DELTA, "operations.1.id") == "tree"
    assert field(DELTA, "operations.0.attributes.x_m") == 1.5
    assert field(DELTA, "operations.0.samples.2.1") == 5.0


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        ("operation", "no 'operation' on the way to 'operation': there are stamp_ns, seq"),
        ("operations.2", "no element 2"),
        ("operations.self", "'self' on the way to 'operations.self' is not a number"),
        ("version.x", "nothing is inside 1"),
        ("version.0", "nothing is inside 1"),
    ],
)
def test_a_path_that_leads_nowhere_names_the_step(path: str, sentence: str) -> None:
    with pytest.raises(LookupError) as caught:
        field(DELTA, path)
    assert sentence in str(caught.value)
