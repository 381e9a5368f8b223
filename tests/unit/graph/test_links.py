"""Links of the graph, one by one and in bulk, by source and by target."""

from __future__ import annotations

import numpy as np

from cogmap.bus.codec import encode
from cogmap.schemas.graph import DropLink, DropNode, Link, Links
from cogmap.schemas.nodes import LinkKind
from cogmap.testing import graph_of
from tests.support.world.scenes import thing

NEAR = "near"


def _link(source: str, target: str, weight: float = 1.0, kind: str = NEAR) -> Link:
    return Link(source=source, target=target, kind=kind, weight=weight)


def test_links_in_bulk_are_the_links_that_they_list() -> None:
    of_a = {"c": 0.25, "b": 1.0}
    of_b = {"c": 0.5}
    graph = graph_of(Links(kind=NEAR, weights={"b": of_b, "a": of_a}))
    (written,) = graph.snapshot().links

    assert graph.links.targets("a", NEAR) == of_a
    assert graph.links.sources("c", NEAR) == ("b", "a")
    assert written == Links(kind=NEAR, weights={"a": {"b": 1.0, "c": 0.25}, "b": of_b})


def test_links_in_bulk_note_the_source_of_those_that_are_new_alone() -> None:
    graph = graph_of(
        Links(kind=NEAR, weights={"a": {"b": 1.0, "c": 1.0}}),
        Links(kind=NEAR, weights={"z": {"d": 1.0, "e": 1.0}}),
        Links(kind=NEAR, weights={"a": {"d": 1.0, "b": 0.5, "e": 1.0}}),
    )

    assert graph.links.targets("a", NEAR) == {"b": 0.5, "c": 1.0, "d": 1.0, "e": 1.0}
    assert graph.links.sources("b", NEAR) == ("a",)
    assert graph.links.sources("d", NEAR) == ("z", "a")
    assert graph.links.sources("e", NEAR) == ("z", "a")


def test_links_in_bulk_leave_other_links_of_their_source() -> None:
    graph = graph_of(
        _link("a", "here", 0.5),
        Links(kind=NEAR, weights={"a": {"there": 1.0}}),
        DropLink(source="a", target="there", kind=NEAR),
    )

    assert graph.links.targets("a", NEAR) == {"here": 0.5}
    assert graph.links.sources("there", NEAR) == ()


def test_links_applied_twice_are_links_applied_once() -> None:
    links = Links(kind=NEAR, weights={"a": {"b": 0.5}})
    at = _link("a", "place:map:0:1:2", kind=LinkKind.AT)

    once = graph_of(links, at)
    twice = graph_of(links, at, links, at)

    assert twice.digest() == once.digest()


def test_a_node_has_one_link_of_an_exclusive_kind() -> None:
    a_here = _link("a", "here", kind=LinkKind.AT)
    b_here = _link("b", "here", kind=LinkKind.AT)
    a_there = _link("a", "there", 0.5, kind=LinkKind.AT)
    links = graph_of(a_here, b_here, a_there).links

    assert links.targets("a", LinkKind.AT) == {"there": 0.5}
    assert links.target("a", LinkKind.AT) == "there"
    assert links.sources("here", LinkKind.AT) == ("b",)
    assert links.sources("there", LinkKind.AT) == ("a",)


def test_links_of_an_exclusive_kind_are_in_bulk_what_they_are_one_by_one() -> None:
    rng = np.random.default_rng(3)
    one_by_one = graph_of()
    in_bulk = graph_of()
    for _ in range(30):
        weights = {}
        for source in rng.permutation(12)[: rng.integers(1, 12)].tolist():
            weights[f"s{source}"] = {f"t{rng.integers(4)}": float(rng.choice([0.5, 1.0]))}

        in_bulk.change([Links(kind=LinkKind.AT, weights=weights)])
        for source, targets in weights.items():
            for target, weight in targets.items():
                one_by_one.change([_link(source, target, weight, LinkKind.AT)])

        assert in_bulk.snapshot().links == one_by_one.snapshot().links
        for target in ("t0", "t1", "t2", "t3"):
            found = in_bulk.links.sources(target, LinkKind.AT)
            assert found == one_by_one.links.sources(target, LinkKind.AT)


def test_of_several_links_of_an_exclusive_kind_in_bulk_the_last_one_is_kept() -> None:
    links = graph_of(Links(kind=LinkKind.AT, weights={"a": {"here": 1.0, "there": 0.5}})).links

    assert links.targets("a", LinkKind.AT) == {"there": 0.5}
    assert links.sources("here", LinkKind.AT) == ()
    assert links.sources("there", LinkKind.AT) == ("a",)


def test_dropping_a_link_that_is_not_there_changes_nothing() -> None:
    graph = graph_of(_link("a", "b"), _link("a", "here", kind=LinkKind.AT))
    before = graph.digest()

    other_target = DropLink(source="a", target="c", kind=NEAR)
    other_place = DropLink(source="a", target="there", kind=LinkKind.AT)
    other_kind = DropLink(source="x", target="y", kind="other")
    graph.change([other_target, other_place, other_kind])

    assert graph.digest() == before


def test_a_forgotten_node_takes_links_to_it_and_from_it_along() -> None:
    weights = {"a": {"b": 0.5, "c": 0.25}, "b": {"a": 0.5}, "d": {"b": 1.0}}
    near = Links(kind=NEAR, weights=weights)
    at = _link("b", "here", kind=LinkKind.AT)
    instance = _link("e", "b", kind=LinkKind.INSTANCE)
    graph = graph_of(thing("a"), thing("b"), near, at, instance, DropNode(id="b"))

    assert graph.snapshot().links == [Links(kind=NEAR, weights={"a": {"c": 0.25}})]
    assert graph.links.sources("here", LinkKind.AT) == ()


def test_a_message_in_the_graph_is_not_changed_by_the_next_one() -> None:
    first = Links(kind=NEAR, weights={"a": {"b": 0.5}})
    second = Links(kind=NEAR, weights={"a": {"b": 1.0, "c": 1.0}})

    before = encode(first)
    graph_of(first, second, _link("a", "d"))

    assert encode(first) == before
