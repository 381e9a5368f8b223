"""Links in bulk, in the graph."""

from __future__ import annotations

from cogmap.bus.codec import encode
from cogmap.graph.graph import Graph
from schemas.graph import DropLink, DropNode, Link, Links, Node


def linked(*operations: Link | Links | DropLink | Node | DropNode) -> list[Link]:
    """Every link of a graph in which `operations` were carried out."""
    graph = Graph()
    graph.change(list(operations))
    return graph.snapshot().links


def test_links_in_bulk_are_the_links_that_they_list() -> None:
    assert linked(Links(kind="sees", weights={"b": {"c": 0.5}, "a": {"c": 0.25, "b": 1.0}})) == [
        Link(source="a", kind="sees", target="b", weight=1.0),
        Link(source="a", kind="sees", target="c", weight=0.25),
        Link(source="b", kind="sees", target="c", weight=0.5),
    ]


def test_links_in_bulk_leave_other_links_of_their_source_and_can_be_dropped_one_by_one() -> None:
    here = Link(source="a", target="here", weight=0.5)

    assert linked(
        here, Links(weights={"a": {"there": 1.0}}), DropLink(source="a", target="there")
    ) == [here]


def test_links_in_bulk_applied_twice_are_links_applied_once() -> None:
    links = Links(weights={"a": {"b": 0.5}})

    assert linked(links, links) == linked(links)


def test_a_forgotten_node_takes_bulk_links_to_it_and_from_it_along() -> None:
    nodes = [Node(id=name, kind="object") for name in ("a", "b")]
    links = Links(weights={"a": {"b": 0.5, "c": 0.25}, "b": {"a": 0.5}, "d": {"b": 1.0}})

    assert linked(*nodes, links, DropNode(id="b")) == [Link(source="a", target="c", weight=0.25)]


def test_a_message_in_the_graph_is_not_changed_by_the_next_one() -> None:
    graph = Graph()
    first = Links(weights={"a": {"b": 0.5}})
    before = encode(first)

    graph.change([first, Links(weights={"a": {"b": 1.0, "c": 1.0}}), Link(source="a", target="d")])

    assert encode(first) == before
