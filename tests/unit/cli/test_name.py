"""Naming what is on the map."""

from __future__ import annotations

import msgspec
import pytest
from click.testing import CliRunner

from cogmap.cli.name import found, listed, name
from cogmap.errors import UsageError
from cogmap.testing import agent, graph_of, landmark

INN = landmark("41a", [(3.0, 4.0)], names={"inn": 5.0})
OTHER_INN = landmark("52b", [(30.0, 4.0)], names={"inn": 5.0})
NAMELESS = landmark("60a", [(1.0, -2.0)], names={"": 3.0})


def test_an_object_is_found_by_its_label_or_by_a_name_that_no_other_has() -> None:
    graph = graph_of(agent(), INN, NAMELESS)

    assert found("60a", graph).label == "60a"
    assert found("object:60a", graph).label == "60a"
    assert found("inn", graph).label == "41a"


def test_a_name_that_several_have_is_refused_with_their_labels() -> None:
    with pytest.raises(UsageError, match="2 objects are called inn: name one by its label, 41a"):
        found("inn", graph_of(agent(), INN, OTHER_INN))


def test_what_is_not_on_the_map_is_refused() -> None:
    with pytest.raises(UsageError, match="nothing on the map is mill: `cogmap name` lists"):
        found("mill", graph_of(agent(), INN))


def test_the_list_has_label_name_and_place_of_each_object() -> None:
    graph = graph_of(agent(), INN, NAMELESS)

    assert listed(graph, as_json=False) == "41a  inn  3.0 4.0\n60a  -    1.0 -2.0"
    assert msgspec.json.decode(listed(graph, as_json=True))[0] == {
        "label": "41a",
        "name": "inn",
        "x_m": 3.0,
        "y_m": 4.0,
    }
    assert listed(graph_of(agent()), as_json=False) == "nothing is on the map yet"


def test_an_object_without_a_name_to_give_is_refused() -> None:
    result = CliRunner().invoke(name, ["41a"])

    assert str(result.exception) == "no name is given for 41a: cogmap name 41a NAME"
