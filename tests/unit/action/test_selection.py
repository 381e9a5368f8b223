"""Behaviours compete by activation until one is above threshold."""

from __future__ import annotations

import pytest

from schemas.cognition import Rejection
from schemas.nodes import Node
from services.action.config import Config
from services.action.selection import FOLLOW_ROUTE, HALT, ActionSelection, Scheme


def _nodes(**activations: float) -> list[Node]:
    """Nodes of these kinds, as activated; of the generic node, for its kind is what counts here."""
    return [
        Node(id=kind, kind=kind, activation=activation) for kind, activation in activations.items()
    ]


def test_a_schemes_activation_is_mean_context_plus_mean_salience() -> None:
    scheme = Scheme("s", context=("a", "b"), adding={"c": 0.2, "d": -0.4})
    partly_active = {"a": 0.3, "b": 0.1}
    fully_active = {"a": 1.0, "b": 1.0}

    assert scheme.activation(partly_active) == pytest.approx(0.2 + 0.3)
    assert scheme.activation(fully_active) == 1.0


def test_a_scheme_lacking_part_of_its_context_is_not_active() -> None:
    scheme = Scheme("s", context=("a", "b"), adding={"c": 1.0})

    assert scheme.activation({"a": 1.0}) == 0.0


def test_the_threshold_falls_with_each_attempt_until_one_selects() -> None:
    selection = ActionSelection(Config())
    route = {"route_ahead": 0.5}

    attempts = [selection.select(_nodes(self=0.4), route) for _ in range(10)]
    chosen = [number for number, attempt in enumerate(attempts) if attempt is not None]

    assert chosen == [3, 7]  # 0.45 + 0.2 is under 0.9, 0.8 and 0.7, and not under 0.6


def test_a_scheme_less_active_than_is_instantiated_is_never_selected() -> None:
    selection = ActionSelection(Config(instantiation=0.8))

    assert [selection.select(_nodes(self=0.4), {"route_ahead": 0.5}) for _ in range(20)] == [
        None
    ] * 20


def test_following_the_route_needs_an_agent_that_knows_where_it_is() -> None:
    selection = ActionSelection(Config(selection_threshold=0.0))

    assert selection.select(_nodes(object=1.0), {"route_ahead": 1.0, "route_end": 0.0}) is None


def test_the_end_of_the_route_calls_for_a_halt() -> None:
    chosen = ActionSelection(Config()).select(
        _nodes(self=1.0), {"route_ahead": 0.0, "route_end": 1.0}
    )

    assert chosen is not None
    assert chosen.chosen.scheme == HALT


def test_every_behaviour_is_reported_and_why_it_was_not_chosen() -> None:
    selection = ActionSelection(Config(selection_threshold=0.0, instantiation=0.5))
    nodes = _nodes(self=1.0)
    both = selection.select(nodes, {"route_ahead": 1.0, "route_end": 0.3})

    assert both is not None
    assert [(each.scheme, each.rejection) for each in both.considered] == [
        (FOLLOW_ROUTE, Rejection.NONE),
        (HALT, Rejection.LESS_ACTIVE),
    ]

    weak = selection.select(nodes, {"route_ahead": 1.0, "route_end": 0.1})
    missing = selection.select(nodes, {"route_ahead": 1.0})

    assert weak is not None
    assert missing is not None
    assert weak.considered[1].rejection is Rejection.NOT_INSTANTIATED
    assert missing.considered[1].rejection is Rejection.CONTEXT_MISSING
    assert missing.considered[1].activation == 0.0
