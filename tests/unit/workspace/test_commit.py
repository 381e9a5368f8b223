"""The ledger checks proposals and commits them as deltas."""

from __future__ import annotations

import tracemalloc

import msgspec
import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Proposal
from cogmap.schemas.graph import (
    Cells,
    Decay,
    DropLink,
    DropNode,
    DropPlaces,
    Link,
    Links,
    Operation,
    Phase,
    PlaceTile,
)
from cogmap.schemas.nodes import ROOT_MAP, TILE_SIDE, LinkKind, Map, Node, PlaceColumn, object_id
from cogmap.services.workspace.commit import REMEMBERED_VERSIONS, Ledger
from cogmap.testing import agent, landmark, percept, task
from tests.support.world.scenes import Desk, answer, thing

WRITABLE = frozenset({Node, *PlaceColumn})


def _may_write(written: object) -> bool:
    return written in WRITABLE


def _cells(where: object = ((0, 0),), dtype: str = "<i4", number: int = 1, **facts: str) -> Cells:
    return Cells(
        column=PlaceColumn.ROAD,
        cells=Array.of(where, dtype),
        values=Array.of(np.ones(number, np.float32)),
        **facts,
    )


def _ledger() -> Ledger:
    """A ledger at version 3: `a` was written by the first commit, `b` by the third."""
    ledger = Ledger({"dreaming": _may_write, "drawing": lambda written: False})
    for name in ("a", "c", "b"):
        ledger.commit(0, 1, Phase.OBJECTS, [thing(name)])
    return ledger


def _proposal(*operations: Operation, base_version: int = 3, failure: str = "") -> Proposal:
    return answer(task("dreaming", version=base_version), operations, failure=failure)


SENSELESS: dict[str, Operation] = {
    "PlaceTile is the workspace's own to write": PlaceTile(x=0, y=0, columns={}),
    "Decay is the workspace's own to write": Decay(),
    "place nodes are written as cells": thing("place:map:0:1:2"),
    "may not write nodes of kind object": landmark("a"),
    "may not write links of kind at": Link(source="a", target="b"),
    "may not write links of kind instance": Links(kind="instance", weights={"a": {"b": 1.0}}),
    "may not write links of kind observes": DropLink(source="a", target="b", kind="observes"),
    "a is of kind object": Node(id=object_id("a"), kind="thing"),
    "a generic node of the known kind object": Node(id="x", kind="object"),
    "there is no map map:7": _cells(map="map:7"),
    "cells of shape (1, 3)": _cells(where=((0, 0, 0),)),
    "cells of shape (1, 2) with (2,) values": _cells(number=2),
    "cells of shape (2,)": _cells(where=(0, 0)),
    "cells of shape (1, 1, 2) with (1, 1) values": Cells(
        column=PlaceColumn.ROAD,
        cells=Array.of([[[0, 0]]], "<i4"),
        values=Array.of(np.ones((1, 1), np.float32)),
    ),
    "at most 65536 are taken": _cells(where=np.zeros((2**16 + 1, 2)), number=2**16 + 1),
    "a cell 1048577 cells away": _cells(where=((0, -(2**20) - 1),)),
    "a cell 2147483648 cells away": _cells(where=((-(2**31), 0),)),
    "cells in 1025 tiles": _cells(
        where=[(TILE_SIDE * tile, 0) for tile in range(1025)], number=1025
    ),
    "self is never forgotten": DropNode(id="self"),
    "map:0 is never forgotten": DropNode(id="map:0"),
    "the places of map:0 are never forgotten": DropPlaces(map=ROOT_MAP),
    "there is no map map:8": DropPlaces(map="map:8"),
    "may not forget the places of map:1": DropPlaces(map="map:1"),
    "may not forget nodes of kind object": DropNode(id=object_id("a")),
}


def _permissive() -> Ledger:
    """A ledger without a commit, in which dreaming may write everything."""
    return Ledger({"dreaming": lambda written: True})


@pytest.mark.parametrize("reason", SENSELESS)
def test_an_invalid_proposal_is_rejected_and_the_next_delta_counts_it(
    reason: str,
) -> None:
    ledger = _ledger()
    root = Map(id=ROOT_MAP, cell_m=1.0)
    part = Map(id="map:1", cell_m=1.0, parent=ROOT_MAP)
    ledger.commit(0, 1, Phase.OBJECTS, [root, part, agent(), landmark("a")])
    proposal = _proposal(thing("new"), SENSELESS[reason], base_version=4)

    with pytest.raises(MessageError) as refusal:
        ledger.check(proposal)
    assert reason in str(refusal.value)

    before = ledger.graph.digest()
    assert ledger.validate([proposal]) == []
    assert ledger.graph.digest() == before

    told = ledger.commit(0, 2, Phase.END, [])
    assert told.rejected == 1
    assert any(reason in sentence for sentence in told.reasons)

    later = ledger.commit(0, 2, Phase.END, [])
    assert later.rejected == 0
    assert later.reasons == []


def test_a_cell_array_of_another_kind_of_number_is_refused() -> None:
    long_integers = _proposal(_cells(dtype="<i8"))

    with pytest.raises(MessageError, match="cells of shape"):
        _ledger().check(long_integers)


def test_a_proposal_with_a_failure_is_rejected_whatever_else_it_holds() -> None:
    ledger = _ledger()
    failed = _proposal(thing("new"), failure="too few samples")
    assert ledger.validate([failed]) == []

    delta = ledger.commit(0, 2, Phase.END, [])
    assert delta.reasons == ["proposal 1/dreaming failed: too few samples"]


def test_a_proposal_of_a_codelet_that_is_not_configured_is_rejected() -> None:
    asked = task("flying", version=3)
    proposal = answer(asked, [thing("new")])

    with pytest.raises(MessageError, match="no codelet 'flying' is configured here"):
        _ledger().check(proposal)


@pytest.mark.parametrize("target", ["object:house", "place:map:9:1:2"])
def test_a_node_is_linked_to_a_place_of_a_map_that_exists(target: str) -> None:
    link = Link(source="self", target=target)
    proposal = _proposal(link, base_version=0)

    with pytest.raises(MessageError, match=r"is no place node|there is no map map:9"):
        _permissive().check(proposal)


def test_an_object_is_on_a_map_that_exists() -> None:
    proposal = _proposal(landmark("a", map="map:9"), base_version=0)

    with pytest.raises(MessageError, match="there is no map map:9"):
        _permissive().check(proposal)


def test_what_a_codelet_may_write_is_its_own() -> None:
    asked = task("drawing", version=3)

    with pytest.raises(MessageError, match="may not write nodes of kind node"):
        _ledger().check(answer(asked, [thing("new")]))
    with pytest.raises(MessageError, match="may not write the place column road"):
        _ledger().check(answer(asked, [_cells()]))


def test_the_first_reasons_are_reported_in_short_and_the_rest_counted() -> None:
    ledger = _ledger()
    long = "x" * 10_000
    ledger.validate([_proposal(failure=f"{number}{long}") for number in range(100)])
    delta = ledger.commit(0, 2, Phase.END, [])

    before = len("proposal 1/dreaming failed: ")
    numbers = [sentence[before] for sentence in delta.reasons]
    lengths = [len(sentence) for sentence in delta.reasons]
    assert delta.rejected == 100
    assert numbers == list("01234567")
    assert max(lengths) == 200


@pytest.mark.parametrize("name", ["place:m:here:there", "place:m:1:", "place:::", "place:1"])
def test_a_node_that_is_only_called_like_a_place_is_a_node_like_any_other(name: str) -> None:
    ledger = _ledger()
    proposal = _proposal(thing(name))

    ledger.check(proposal)
    assert ledger.validate([proposal]) == [proposal]


def test_a_proposal_on_a_version_that_is_not_committed_yet_is_refused() -> None:
    early = _proposal(base_version=4)

    with pytest.raises(MessageError, match="version 4, which is not committed yet"):
        _ledger().check(early)


def test_a_proposal_is_late_only_for_nodes_changed_since_its_version() -> None:
    ledger = _ledger()
    ledger.check(_proposal(thing("a"), base_version=1))

    with pytest.raises(MessageError, match="late: b has changed since 2"):
        ledger.check(_proposal(thing("b"), base_version=2))
    with pytest.raises(MessageError, match="late: b has changed"):
        ledger.check(_proposal(DropNode(id="b"), base_version=2))


def test_what_was_written_long_ago_is_known_no_more_and_answers_on_it_are_late() -> None:
    ledger = _ledger()
    for number in range(2 * REMEMBERED_VERSIONS):
        ledger.commit(0, 1, Phase.OBJECTS, [thing(f"seen-{number}")])
    version = ledger.graph.version

    ledger.check(_proposal(thing("a"), base_version=version - REMEMBERED_VERSIONS))
    with pytest.raises(MessageError, match="is late"):
        ledger.check(_proposal(thing("a"), base_version=version - 2 * REMEMBERED_VERSIONS))


def test_the_memory_of_what_was_written_does_not_grow_with_time() -> None:
    ledger = _ledger()
    kept_bytes = []
    tracemalloc.start()
    for number in range(6 * REMEMBERED_VERSIONS):
        node = thing(f"seen-{number}")
        ledger.commit(0, 1, Phase.OBJECTS, [node, DropNode(id=node.id)])
        if number % (2 * REMEMBERED_VERSIONS) == REMEMBERED_VERSIONS:
            kept_bytes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()

    assert kept_bytes[-1] < 1.2 * kept_bytes[0]


def test_links_are_never_late() -> None:
    ledger = _ledger()
    near = Link(source="b", target="a", kind="near")
    dropped = DropLink(source="b", target="c", kind="near")
    proposal = _proposal(near, dropped, base_version=1)

    assert ledger.validate([proposal]) == [proposal]


def test_cells_are_late_where_their_tiles_column_has_changed_since() -> None:
    ledger = _ledger()
    ledger.commit(0, 1, Phase.OBJECTS, [_cells()])
    other_tile = _cells(where=((TILE_SIDE, 0),))
    other_column = msgspec.structs.replace(_cells(), column=PlaceColumn.OBSTACLE)
    same_tile = _cells(where=((TILE_SIDE - 1, 0),))

    ledger.check(_proposal(other_tile, base_version=3))
    ledger.check(_proposal(other_column, base_version=3))
    with pytest.raises(MessageError, match="late: map:0 0 0 road has changed since 3"):
        ledger.check(_proposal(same_tile, base_version=3))


def test_of_two_answers_about_one_column_of_a_tile_the_first_is_committed() -> None:
    ledger = _ledger()
    first = _proposal(_cells())
    same_tile = _proposal(thing("new"), _cells(where=((1, 1),)))
    elsewhere = _proposal(_cells(where=((TILE_SIDE, 0),)))

    assert ledger.validate([first, same_tile, elsewhere]) == [first, elsewhere]
    counted = ledger.commit(0, 2, Phase.END, [])
    assert counted.rejected == 1
    assert "map:0 0 0 road is written by another in this phase" in counted.reasons[0]


def test_cells_of_another_map_are_never_late() -> None:
    ledger = _ledger()
    hall = Map(id="map:hall", cell_m=0.5, parent=ROOT_MAP)
    ledger.commit(0, 1, Phase.OBJECTS, [hall])
    ledger.commit(0, 1, Phase.OBJECTS, [_cells()])

    ledger.check(_proposal(_cells(map="map:hall"), base_version=4))
    ledger.commit(0, 1, Phase.OBJECTS, [_cells(map="map:hall")])
    with pytest.raises(MessageError, match="late: map:hall 0 0 road"):
        ledger.check(_proposal(_cells(map="map:hall"), base_version=5))


@pytest.mark.parametrize(
    "change",
    [Map(id="map:1", cell_m=0.5, parent=ROOT_MAP, x_m=9.0), DropPlaces(map="map:1")],
)
def test_cells_are_late_where_the_frame_that_they_are_in_has_changed_since(
    change: Operation,
) -> None:
    ledger = _ledger()
    ledger.commit(0, 1, Phase.OBJECTS, [Map(id="map:1", cell_m=0.5, parent=ROOT_MAP)])
    proposal = _proposal(_cells(map="map:1"), base_version=4)
    ledger.check(proposal)

    ledger.commit(0, 1, Phase.OBJECTS, [change])
    with pytest.raises(MessageError, match="late: map:1 has changed since 4"):
        ledger.check(proposal)


def test_sub_maps_are_late_where_the_frame_that_they_are_in_has_changed_since() -> None:
    ledger = _permissive()
    root = Map(id=ROOT_MAP, cell_m=1.0)
    sub_map = Map(id="map:1", cell_m=0.5, parent=ROOT_MAP)
    ledger.commit(0, 1, Phase.OBJECTS, [root, sub_map, thing("a")])
    within = Links(kind=LinkKind.WITHIN, weights={"a": {"map:1": 1.0}})
    another = Map(id="map:2", cell_m=0.5, parent=ROOT_MAP)
    ledger.check(_proposal(within, base_version=1))
    ledger.check(_proposal(another, base_version=1))

    ledger.commit(0, 1, Phase.CORRECTION, [root, sub_map])
    with pytest.raises(MessageError, match="late: map:1 has changed since 1"):
        ledger.check(_proposal(within, base_version=1))
    with pytest.raises(MessageError, match="late: map:0 has changed since 1"):
        ledger.check(_proposal(another, base_version=1))


def test_one_proposal_that_is_refused_keeps_no_other_from_being_committed() -> None:
    ledger = _ledger()
    good = _proposal(thing("new"))
    bad = _proposal(Decay())

    assert ledger.validate([bad, good]) == [good]


def test_a_refused_answer_lets_the_cycle_continue() -> None:
    desk = Desk("w1")
    desk.see(0, percept("a"))
    (localization,) = desk.take()
    desk.feed(answer(localization, [DropNode(id="self")]))
    desk.work()

    phases = [delta.phase for delta in desk.deltas]
    rejected = [delta.rejected for delta in desk.deltas]

    assert phases == ["percepts", "objects", "attention", "end"]
    assert rejected == [0, 1, 0, 0]


def test_what_was_written_before_a_restart_still_counts_as_written() -> None:
    ledger = Ledger({"dreaming": _may_write})
    again = Ledger({"dreaming": _may_write})
    for name in ("a", "c", "b"):
        again.restore(ledger.commit(0, 1, Phase.OBJECTS, [thing(name)]))
    assert again.graph.digest() == ledger.graph.digest()

    again.check(_proposal(thing("c"), base_version=2))
    with pytest.raises(MessageError, match="b has changed"):
        again.check(_proposal(thing("b"), base_version=2))


def test_what_a_snapshot_holds_counts_as_written_at_its_version() -> None:
    snapshot = _ledger().graph.snapshot()
    again = Ledger({"dreaming": _may_write})
    again.restore(snapshot)

    again.check(_proposal(thing("a"), base_version=3))

    with pytest.raises(MessageError, match="a has changed since 2"):
        again.check(_proposal(thing("a"), base_version=2))


def test_applying_a_deltas_operations_twice_is_applying_them_once() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("a"), percept("b", 0.6))
    once = Graph()
    twice = Graph()
    for delta in desk.deltas:
        once.apply(delta)
        twice.change(delta.operations)
        twice.apply(delta)

        assert twice.digest() == once.digest()


def test_a_forgotten_node_takes_its_links_with_it() -> None:
    there = Link(source="a", target="b")
    back = Link(source="b", target="a")
    here = Link(source="b", target="here", kind="near")
    graph = Graph()
    graph.change([thing("a"), thing("b"), there, back, _cells()])
    graph.change([here, DropNode(id="a")])
    (kept,) = graph.snapshot().links

    assert list(graph.nodes) == ["b"]
    assert kept == Links(kind="near", weights={"b": {"here": 1.0}})


def test_the_ledger_keeps_the_nodes_of_a_commit_as_they_were_written() -> None:
    said = Node(id="a", kind="thing", activation=0.25, attributes={"x_m": 1.0})
    ledger = Ledger({})

    delta = ledger.commit(5, 2, Phase.OBJECTS, [said], ["2/object_place/a"])

    assert delta.stamp_ns == 5
    assert delta.version == 1
    assert delta.cycle == 2
    assert delta.tasks == ["2/object_place/a"]
    assert ledger.graph.nodes["a"] == said
