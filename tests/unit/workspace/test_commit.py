from __future__ import annotations

import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.graph.graph import TILE_SIDE, Graph
from schemas.array import Array
from schemas.graph import (
    Activations,
    Cells,
    Delta,
    DropLink,
    DropNode,
    Link,
    Node,
    Operation,
    PlaceTile,
    Proposal,
)
from services.workspace.commit import Ledger
from tests.support.scenes import Desk, answer, node, percept, task

POSE = {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0, "stamp_ns": 1}


def _cells(
    column: str = "road", where: object = ((0, 0),), dtype: str = "<i4", number: int = 1
) -> Cells:
    return Cells(
        column=column, cells=Array.of(where, dtype), values=Array.of(np.ones(number, np.float32))
    )


def _tile() -> PlaceTile:
    column = Array.of(np.zeros((TILE_SIDE, TILE_SIDE), np.float32))
    return PlaceTile(
        x=0, y=0, side=TILE_SIDE, cell_m=1.0, activation=column, road=column, traversable=column
    )


def _activations() -> Activations:
    one = Array.of(np.ones(1, np.float32))
    return Activations(ids=["a"], values=one, base_levels=one)


def _ledger() -> Ledger:
    """A ledger at version 3: `a` was written by the first commit, `b` by the third."""
    ledger = Ledger(1.0)
    for name in ("a", "c", "b"):
        ledger.commit(0, 1, "objects", [node(name)])
    return ledger


def _proposal(*operations: Operation, base_version: int = 3, failure: str = "") -> Proposal:
    return answer(task("object_place", base_version=base_version), operations, failure=failure)


SENSELESS: dict[str, Operation] = {
    "codelets do not write PlaceTile": _tile(),
    "codelets do not write Activations": _activations(),
    "place nodes are written as cells": node("place:1:2"),
    "with samples of shape (4,)": node("a", np.zeros(4)),
    "with samples of shape (4, 5)": node("a", np.zeros((4, 5))),
    "with samples of shape (0, 2)": node("a", np.zeros((0, 2))),
    "cells of shape (1, 3)": _cells(where=((0, 0, 0),)),
    "cells of shape (1, 2) with (2,) values": _cells(number=2),
    "cells of shape (2,)": _cells(where=(0, 0)),
    "cells of shape (1, 1, 2) with (1, 1) values": Cells(
        column="road",
        cells=Array.of([[[0, 0]]], "<i4"),
        values=Array.of(np.ones((1, 1), np.float32)),
    ),
    "at most 65536 are taken": _cells(where=np.zeros((2**16 + 1, 2)), number=2**16 + 1),
    "a cell 1048577 cells away": _cells(where=((0, -(2**20) - 1),)),
    "a cell 2147483648 cells away": _cells(where=((-(2**31), 0),)),
    "cells in 1025 tiles": _cells(
        where=[(TILE_SIDE * tile, 0) for tile in range(1025)], number=1025
    ),
    "place nodes have no column 'colour'": _cells(column="colour"),
    "the self node is never forgotten": DropNode(id="self"),
    "self without stamp_ns": node("self", np.zeros((4, 3)), x_m=0.0, y_m=0.0, heading_rad=0.0),
    "self without x_m": node("self", np.zeros((4, 3)), **{**POSE, "x_m": "here"}),
    "self without samples of its pose": node("self", np.zeros((4, 2)), **POSE),
}


@pytest.mark.parametrize("reason", SENSELESS)
def test_a_senseless_proposal_is_refused_with_a_reason_and_the_next_delta_counts_it(
    reason: str,
) -> None:
    ledger = _ledger()
    proposal = _proposal(node("new"), SENSELESS[reason])
    with pytest.raises(MessageError) as refusal:
        ledger.check(proposal)
    assert reason in str(refusal.value)
    before = ledger.graph.digest()
    assert ledger.judge([proposal]) == ([], [])
    assert ledger.graph.digest() == before
    told, later = (ledger.commit(0, 2, "decay", []) for _ in range(2))
    assert (told.dropped, later.dropped, later.refused) == (1, 0, [])
    assert [sentence for sentence in told.refused if reason in sentence]


def test_a_cell_array_of_another_kind_of_number_is_refused() -> None:
    with pytest.raises(MessageError, match="cells of shape"):
        _ledger().check(_proposal(_cells(dtype="<i8")))


def test_a_proposal_that_tells_of_a_failure_is_dropped_whatever_else_it_holds() -> None:
    ledger = _ledger()
    assert ledger.judge([_proposal(node("new"), failure="too few samples")]) == ([], [])
    assert ledger.commit(0, 2, "decay", []).refused == [
        "proposal 1/object_place failed: too few samples"
    ]


def test_reasons_are_told_of_the_first_few_and_in_short_and_the_rest_is_counted() -> None:
    ledger = _ledger()
    ledger.judge([_proposal(failure=f"{number}" + "x" * 10_000) for number in range(100)])
    delta = ledger.commit(0, 2, "decay", [])
    assert delta.dropped == 100
    assert [
        sentence[len("proposal 1/object_place failed: ")] for sentence in delta.refused
    ] == list("01234567")
    assert max(map(len, delta.refused)) == 200


@pytest.mark.parametrize("name", ["place:here:there", "place:1:", "place::", "place:1"])
def test_a_node_that_is_only_called_like_a_place_is_a_node_like_any_other(name: str) -> None:
    _ledger().check(_proposal(node(name)))


def test_a_proposal_on_a_version_that_is_not_committed_yet_is_refused() -> None:
    with pytest.raises(MessageError, match="version 4, which is not committed yet"):
        _ledger().check(_proposal(base_version=4))


def test_a_proposal_is_late_only_for_nodes_that_have_changed_since_its_version() -> None:
    ledger = _ledger()
    ledger.check(_proposal(node("a"), base_version=1))
    with pytest.raises(MessageError, match="late: b has changed since version 2"):
        ledger.check(_proposal(node("b"), base_version=2))
    with pytest.raises(MessageError, match="late: b has changed"):
        ledger.check(_proposal(DropNode(id="b"), base_version=2))


def test_links_and_cells_are_never_late() -> None:
    _ledger().check(
        _proposal(
            Link(source="b", target="a"), DropLink(source="b", target="c"), _cells(), base_version=1
        )
    )


def test_one_proposal_that_is_refused_keeps_no_other_from_being_committed() -> None:
    ledger = _ledger()
    good = _proposal(node("new"))
    bad = _proposal(_tile())
    operations, tasks = ledger.judge([bad, good])
    assert operations == good.operations
    assert tasks == [good.task_id]


def test_a_refused_answer_lets_the_cycle_go_on() -> None:
    desk = Desk("w1")
    desk.see(0, percept("a"))
    desk.feed(answer(desk.take()[0], [DropNode(id="self")]))
    desk.work()
    assert [delta.phase for delta in desk.deltas] == ["percepts", "objects", "decay"]
    assert [delta.dropped for delta in desk.deltas] == [0, 1, 0]


def test_what_was_written_before_a_restart_still_counts_as_written() -> None:
    ledger = _ledger()
    again = Ledger(1.0)
    for version, name in enumerate(("a", "c", "b"), 1):
        again.restore(
            Delta(version=version, cycle=1, phase="objects", tasks=[], operations=[node(name)])
        )
    assert again.graph.digest() == ledger.graph.digest()
    with pytest.raises(MessageError, match="b has changed"):
        again.check(_proposal(node("b"), base_version=2))


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
        [node("a"), node("b"), Link(source="a", target="b"), Link(source="b", target="a"), _cells()]
    )
    graph.change([Link(source="b", target="place:0:0"), DropNode(id="a")])
    assert list(graph.nodes) == ["b"]
    assert graph.snapshot().links == [Link(source="b", target="place:0:0")]


def test_the_ledger_keeps_the_nodes_of_a_commit_as_they_were_said() -> None:
    said = Node(id="a", kind="object", activation=0.25, attributes={"x_m": 1.0})
    ledger = Ledger(1.0)
    delta = ledger.commit(5, 2, "objects", [said], ["2/object_place/a"])
    assert (delta.stamp_ns, delta.version, delta.cycle, delta.tasks) == (
        5,
        1,
        2,
        ["2/object_place/a"],
    )
    assert ledger.graph.nodes["a"] == said
