"""Behaviours compete by activation until one is above threshold."""

from __future__ import annotations

from cogmap.schemas.cognition import Behaviour, Rejection
from cogmap.services.action.selection import ActionSelection, MostActive, Selection
from tests.support.world.behaviours import behaviour, lacking


def _selection(threshold: float = 0.9) -> ActionSelection:
    return ActionSelection(MostActive(), threshold, 0.1)


def _chosen(selection: Selection) -> str:
    return "" if selection.chosen is None else selection.chosen.scheme


def _rejections(selection: Selection) -> dict[str, Rejection]:
    return {each.scheme: each.rejection for each in selection.considered}


def test_the_threshold_falls_with_each_attempt_until_one_selects() -> None:
    selection = _selection()
    attempts = [selection.select([behaviour("follow", 0.65)]) for _ in range(10)]

    chosen = [number for number, attempt in enumerate(attempts) if attempt.chosen is not None]
    assert chosen == [3, 7]  # 0.65 is under 0.9, 0.8 and 0.7, and not under 0.6


def test_a_scheme_that_is_not_instantiated_is_never_selected() -> None:
    weak = behaviour("follow", 0.65, rejection=Rejection.NOT_INSTANTIATED)
    selection = _selection()

    assert [_chosen(selection.select([weak])) for _ in range(20)] == [""] * 20


def test_the_most_active_behaviour_is_chosen_of_equals_the_most_reliable() -> None:
    selection = _selection()
    low = behaviour("low", 0.91, reliability=1.0)
    often = behaviour("b", 0.95, reliability=0.9)
    seldom = behaviour("a", 0.95, reliability=0.3)
    other = behaviour("c", 0.95, reliability=0.9)

    assert _chosen(selection.select([low, seldom, other, often])) == "b"


def test_every_behaviour_is_reported_and_why_it_was_not_chosen() -> None:
    both = [behaviour("follow", 1.0), behaviour("halt", 0.6), lacking("dock", "target")]

    selection = _selection(0.0).select(both)

    assert _rejections(selection) == {
        "follow": Rejection.NONE,
        "halt": Rejection.LESS_ACTIVE,
        "dock": Rejection.CONTEXT_MISSING,
    }
    assert [each.activation for each in selection.considered] == [1.0, 0.6, 0.0]


def test_where_none_is_chosen_that_is_reported_too() -> None:
    selection = _selection().select([behaviour("follow", 0.5), lacking("dock", "target")])

    assert selection.chosen is None
    assert _rejections(selection) == {
        "follow": Rejection.BELOW_THRESHOLD,
        "dock": Rejection.CONTEXT_MISSING,
    }


def test_without_behaviours_nothing_is_chosen() -> None:
    none: list[Behaviour] = []

    assert _selection(0.0).select(none).chosen is None
