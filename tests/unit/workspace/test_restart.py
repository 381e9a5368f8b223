"""A workspace restored from its deltas or a snapshot continues where the one before ended."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cogmap.runtime.run import Run
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import Node
from cogmap.testing import of_type, percept
from tests.support.world.scenes import Desk, thing

OFFERED = Run(lockstep=True, participants={"memory": 1})


def _restored(past: Sequence[Message]) -> Desk:
    desk = Desk("w1")
    assert desk.module.restore is not None
    desk.module.restore(list(past))
    return desk


def _restored_each_way(desk: Desk) -> list[Desk]:
    """Restored from deltas, from a snapshot, and from a snapshot and the delta that it holds."""
    assert desk.module.compact is not None
    snapshot = desk.module.compact()
    return [
        _restored(desk.deltas),
        _restored([snapshot]),
        _restored([snapshot, desk.deltas[-1]]),
    ]


def test_a_restored_workspace_has_the_same_graph() -> None:
    desk = Desk("w1")
    desk.drive(range(4), percept("a"), percept("b", 0.5))

    for restored in _restored_each_way(desk):
        assert restored.digest == desk.digest


def test_a_restored_workspace_continues_the_numbers() -> None:
    desk = Desk("w1")
    desk.drive(range(4), percept("a"), percept("b", 0.5))
    last = desk.deltas[-1]
    restored = _restored_each_way(desk)

    for each in restored:
        each.drive(range(4, 5), percept("a"))
        assert each.deltas[0].version == last.version + 1
        assert each.deltas[0].cycle == last.cycle + 1

    assert len({each.digest for each in restored}) == 1


def test_a_restored_workspace_ignores_views_that_it_had_before() -> None:
    desk = Desk("w1")
    desk.drive(range(3))
    again = _restored(desk.deltas)
    again.see(2)

    assert again.deltas == []


@pytest.mark.parametrize("committed", range(1, 4))
def test_an_interrupted_cycle_continues_from_its_last_commit(committed: int) -> None:
    whole = Desk("w1")
    whole.drive(range(3), percept("a"))
    interrupted = Desk("w1")
    interrupted.drive(range(2), percept("a"))
    end = len(interrupted.deltas) + committed

    again = _restored(whole.deltas[:end])
    again.drive(range(2, 3), percept("a"))

    versions = [delta.version for delta in again.deltas]
    assert again.digest == whole.digest
    assert versions == [delta.version for delta in whole.deltas[end:]]


def test_a_cycle_that_was_interrupted_after_background_work_only_ends() -> None:
    whole = Desk("w1")
    scene = [percept("a", 0.3), percept("b", -0.4, 14.0), percept("c", 0.0, 12.0)]
    whole.drive(range(6), *scene)
    phases = [delta.phase for delta in whole.deltas]
    cut = len(phases) - phases[::-1].index(Phase.BACKGROUND)
    frame = whole.deltas[cut - 1].cycle - 1

    again = _restored(whole.deltas[:cut])
    again.drive(range(frame, frame + 1), *scene)

    end = whole.deltas[cut]
    assert end.phase is Phase.END
    assert [(delta.phase, delta.version) for delta in again.deltas] == [(end.phase, end.version)]


def test_a_cycle_whose_view_does_not_come_again_ends_when_the_next_view_comes() -> None:
    whole = Desk("w1")
    whole.drive(range(3), percept("a"))
    interrupted = whole.deltas[:-2]

    again = Desk("w1", run=OFFERED)
    assert again.module.restore is not None
    again.module.restore(list(interrupted))
    cycle = interrupted[-1].cycle

    again.see(3, percept("a"))
    assert [(delta.cycle, delta.phase) for delta in again.deltas] == [(cycle, Phase.END)]

    again.feed(Offer(cycle=cycle, operations=[], source="memory"))
    assert again.deltas[-1].cycle == cycle + 1


def test_an_offer_made_before_a_restart_is_not_committed_again() -> None:
    desk = Desk("w1")
    desk.drive(range(3))
    again = _restored(desk.deltas)

    again.feed(Offer(cycle=1, operations=[thing("old")], source="goal"))
    again.feed(Offer(cycle=3, operations=[thing("new")], source="goal"))
    again.drive(range(3, 4))

    names = set()
    for delta in again.deltas:
        names |= {node.id for node in of_type(Node, delta.operations)}
    assert names == {"new"}
