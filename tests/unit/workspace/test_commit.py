from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from schemas.array import Array
from schemas.codelets import Proposal
from schemas.graph import (
    TILE_SIDE,
    Cells,
    Decay,
    Delta,
    DropLink,
    DropNode,
    Link,
    Links,
    Operation,
    Phase,
    PlaceTile,
)
from schemas.nodes import Node, PlaceColumn, object_id
from services.workspace.commit import Ledger
from tests.support.scenes import Desk, agent, answer, landmark, percept, task, thing

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
    "may not forget nodes of kind object": DropNode(id=object_id("a")),
}


@pytest.mark.parametrize("reason", SENSELESS)
def test_an_invalid_proposal_is_rejected_and_the_next_delta_counts_it(
    reason: str,
) -> None:
    ledger = _ledger()
    ledger.commit(0, 1, Phase.OBJECTS, [agent(), landmark("a")])
    proposal = _proposal(thing("new"), SENSELESS[reason], base_version=4)

    with pytest.raises(MessageError) as refusal:
        ledger.check(proposal)
    assert reason in str(refusal.value)

    before = ledger.graph.digest()
    assert ledger.validate([proposal]) == []
    assert ledger.graph.digest() == before

    told, later = (ledger.commit(0, 2, Phase.END, []) for _ in range(2))
    assert (told.rejected, later.rejected, later.reasons) == (1, 0, [])
    assert [sentence for sentence in told.reasons if reason in sentence]


def test_a_cell_array_of_another_kind_of_number_is_refused() -> None:
    with pytest.raises(MessageError, match="cells of shape"):
        _ledger().check(_proposal(_cells(dtype="<i8")))


def test_a_proposal_with_a_failure_is_rejected_whatever_else_it_holds() -> None:
    ledger = _ledger()

    assert ledger.validate([_proposal(thing("new"), failure="too few samples")]) == []
    assert ledger.commit(0, 2, Phase.END, []).reasons == [
        "proposal 1/dreaming failed: too few samples"
    ]


def test_a_proposal_of_a_codelet_that_is_not_configured_is_rejected() -> None:
    asked = task("flying", version=3)

    with pytest.raises(MessageError, match="no codelet 'flying' is configured here"):
        _ledger().check(answer(asked, [thing("new")]))


@pytest.mark.parametrize("target", ["object:house", "place:map:9:1:2"])
def test_a_node_is_linked_to_a_place_of_a_map_that_exists(target: str) -> None:
    ledger = Ledger({"dreaming": lambda written: True})

    with pytest.raises(MessageError, match=r"is no place node|there is no map map:9"):
        ledger.check(answer(task("dreaming", version=0), [Link(source="self", target=target)]))


def test_an_object_is_on_a_map_that_exists() -> None:
    ledger = Ledger({"dreaming": lambda written: True})

    with pytest.raises(MessageError, match="there is no map map:9"):
        ledger.check(answer(task("dreaming", version=0), [landmark("a", map="map:9")]))


def test_what_a_codelet_may_write_is_its_own() -> None:
    with pytest.raises(MessageError, match="may not write nodes of kind node"):
        _ledger().check(answer(task("drawing", version=3), [thing("new")]))
    with pytest.raises(MessageError, match="may not write the place column road"):
        _ledger().check(answer(task("drawing", version=3), [_cells()]))


def test_the_first_reasons_are_reported_in_short_and_the_rest_counted() -> None:
    ledger = _ledger()
    ledger.validate([_proposal(failure=f"{number}" + "x" * 10_000) for number in range(100)])
    delta = ledger.commit(0, 2, Phase.END, [])

    assert delta.rejected == 100

    first = len("proposal 1/dreaming failed: ")
    assert [sentence[first] for sentence in delta.reasons] == list("01234567")
    assert max(map(len, delta.reasons)) == 200


@pytest.mark.parametrize("name", ["place:m:here:there", "place:m:1:", "place:::", "place:1"])
def test_a_node_that_is_only_called_like_a_place_is_a_node_like_any_other(name: str) -> None:
    _ledger().check(_proposal(thing(name)))


def test_a_proposal_on_a_version_that_is_not_committed_yet_is_refused() -> None:
    with pytest.raises(MessageError, match="version 4, which is not committed yet"):
        _ledger().check(_proposal(base_version=4))


def test_a_proposal_is_late_only_for_nodes_changed_since_its_version() -> None:
    ledger = _ledger()
    ledger.check(_proposal(thing("a"), base_version=1))

    with pytest.raises(MessageError, match="late: b has changed since 2"):
        ledger.check(_proposal(thing("b"), base_version=2))
    with pytest.raises(MessageError, match="late: b has changed"):
        ledger.check(_proposal(DropNode(id="b"), base_version=2))


def test_links_are_never_late() -> None:
    near = Link(source="b", target="a", kind="near")
    dropped = DropLink(source="b", target="c", kind="near")
    _ledger().check(_proposal(near, dropped, base_version=1))


def test_cells_are_late_where_their_tiles_column_has_changed_since() -> None:
    ledger = _ledger()
    ledger.commit(0, 1, Phase.OBJECTS, [_cells()])
    ledger.check(_proposal(_cells(where=((TILE_SIDE, 0),)), base_version=3))
    other = msgspec.structs.replace(_cells(), column=PlaceColumn.OBSTACLE)
    ledger.check(_proposal(other, base_version=3))

    with pytest.raises(MessageError, match="late: map:0 0 0 road has changed since 3"):
        ledger.check(_proposal(_cells(where=((TILE_SIDE - 1, 0),)), base_version=3))


def test_one_proposal_that_is_refused_keeps_no_other_from_being_committed() -> None:
    ledger = _ledger()
    good = _proposal(thing("new"))
    bad = _proposal(Decay())

    assert ledger.validate([bad, good]) == [good]


def test_a_refused_answer_lets_the_cycle_go_on() -> None:
    desk = Desk("w1")
    desk.see(0, percept("a"))
    desk.feed(answer(desk.take()[0], [DropNode(id="self")]))
    desk.work()

    assert [delta.phase for delta in desk.deltas] == ["percepts", "objects", "end"]
    assert [delta.rejected for delta in desk.deltas] == [0, 1, 0]


def test_what_was_written_before_a_restart_still_counts_as_written() -> None:
    ledger = _ledger()
    again = Ledger({"dreaming": _may_write})
    for version, name in enumerate(("a", "c", "b"), 1):
        written = [thing(name)]
        again.restore(Delta(version=version, cycle=1, phase=Phase.OBJECTS, operations=written))

    assert again.graph.digest() == ledger.graph.digest()

    again.check(_proposal(thing("c"), base_version=2))
    with pytest.raises(MessageError, match="b has changed"):
        again.check(_proposal(thing("b"), base_version=2))


def test_what_a_snapshot_holds_counts_as_written_at_its_version() -> None:
    again = Ledger({"dreaming": _may_write})
    again.restore(_ledger().graph.snapshot())
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
    graph = Graph()
    graph.change(
        [
            thing("a"),
            thing("b"),
            Link(source="a", target="b"),
            Link(source="b", target="a"),
            _cells(),
        ]
    )
    graph.change([Link(source="b", target="here", kind="near"), DropNode(id="a")])

    assert list(graph.nodes) == ["b"]
    assert graph.snapshot().links == [Links(kind="near", weights={"b": {"here": 1.0}})]


def test_the_ledger_keeps_the_nodes_of_a_commit_as_they_were_said() -> None:
    said = Node(id="a", kind="thing", activation=0.25, attributes={"x_m": 1.0})
    ledger = Ledger({})
    delta = ledger.commit(5, 2, Phase.OBJECTS, [said], ["2/object_place/a"])

    assert (delta.stamp_ns, delta.version, delta.cycle, delta.tasks) == (
        5,
        1,
        2,
        ["2/object_place/a"],
    )
    assert ledger.graph.nodes["a"] == said
