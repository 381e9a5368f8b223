"""Schemes: their activation, and what nodes make of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.schemas.cognition import Rejection
from cogmap.services.procedural.patterns import Pattern
from cogmap.services.procedural.schemes import Result, Scheme
from tests.support.world.schemes import active, scheme_of, sign

DOCK = """
[[scheme]]
name = "dock"
action = "dock"
context = [{ kind = "sign", as = "it", colour = "green" }, { kind = "sign", as = "it" }]
adding = [{ kind = "sign", as = "it", reached = true, salience = -0.3 }]
deleting = [{ kind = "sign", as = "it", colour = "green" }]
parameters = { x_m = "$it.x_m", y_m = 2.0 }
"""
PATTERNS = (Pattern("a"), Pattern("b"))


def _result(name: str, salience: float) -> Result:
    return Result(Pattern(name), salience)


def test_a_schemes_activation_is_mean_context_plus_mean_salience() -> None:
    adding = (_result("c", 0.2), _result("d", -0.4))
    scheme = Scheme("s", "halt", context=PATTERNS, adding=adding)

    assert scheme.activation([0.3, 0.1]) == pytest.approx(0.2 + 0.3)
    assert scheme.activation([1.0, 1.0]) == 1.0


def test_a_scheme_lacking_part_of_its_context_is_not_active() -> None:
    scheme = Scheme("s", "halt", context=PATTERNS, adding=(_result("c", 1.0),))

    assert scheme.activation([1.0, 0.0]) == 0.0


def test_a_scheme_becomes_a_behaviour_with_the_nodes_that_match(tmp_path: Path) -> None:
    green = sign("b", 0.6, colour="green", x_m=4.0)
    behaviour = scheme_of(tmp_path, DOCK).considered(active(sign("a"), green), 0.1)

    assert not behaviour.rejection
    assert behaviour.activation == pytest.approx(0.6 + 0.3)
    assert behaviour.bindings == {"it": "sign:b"}
    assert behaviour.parameters == {"x_m": 4.0, "y_m": 2.0}
    assert behaviour.context == {"sign id=sign:b colour=green": 0.6, "sign id=sign:b": 0.6}
    assert behaviour.adding == {"sign id=sign:b reached=True": -0.3}
    assert behaviour.deleting == ["sign id=sign:b colour=green"]


def test_a_scheme_of_whose_context_a_pattern_is_missing_is_rejected(tmp_path: Path) -> None:
    behaviour = scheme_of(tmp_path, DOCK).considered(active(sign("a", colour="red")), 0.1)

    assert behaviour.rejection is Rejection.CONTEXT_MISSING
    assert behaviour.activation == 0.0
    assert 0.0 in behaviour.context.values()


def test_a_node_that_is_not_active_is_not_there(tmp_path: Path) -> None:
    behaviour = scheme_of(tmp_path, DOCK).considered(active(sign("a", 0.0, colour="green")), 0.1)

    assert behaviour.rejection is Rejection.CONTEXT_MISSING


def test_a_scheme_below_the_threshold_is_not_instantiated(tmp_path: Path) -> None:
    weak = sign("a", 0.05, colour="green")
    behaviour = scheme_of(tmp_path, DOCK).considered(active(weak), 0.5)

    assert behaviour.rejection is Rejection.NOT_INSTANTIATED
    assert behaviour.activation == pytest.approx(0.35)


def test_results_have_come_true_for_the_nodes_that_the_variables_stand_for(tmp_path: Path) -> None:
    scheme = scheme_of(tmp_path, DOCK)
    nodes = active(sign("a", reached=True), sign("b", reached=False))

    assert scheme.has_come_true(nodes, {"it": "sign:a"})
    assert not scheme.has_come_true(nodes, {"it": "sign:b"})
