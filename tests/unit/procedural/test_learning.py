"""Schemes learn how reliable they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.schemas.cognition import Action, Behaviour
from cogmap.services.procedural.learning import Reliability
from tests.support.world.schemes import FOLLOW, active, scheme_of, sign

GREEN = active(sign(colour="green"))
RED = active(sign(colour="red"))


@pytest.fixture
def reliability(tmp_path: Path) -> Reliability:
    """Of one scheme, whose result, a green sign, is awaited for 2 s."""
    return Reliability([scheme_of(tmp_path, FOLLOW)])


def _action(at_s: float = 0.0, scheme: str = "follow") -> Action:
    stamp_ns = round(at_s * 1e9)
    return Action(stamp_ns=stamp_ns, cycle=1, scheme=scheme, activation=1.0, parameters={})


def _counts(reliability: Reliability) -> tuple[int, int, float]:
    """Executions, successes, and the share of these."""
    noted = reliability.noted(Behaviour(scheme="follow", activation=1.0))
    return noted.executions, noted.successes, noted.reliability


def test_before_it_was_executed_a_scheme_is_as_reliable_as_its_base_level(
    reliability: Reliability,
) -> None:
    assert _counts(reliability) == (0, 0, 0.5)


def test_a_result_that_comes_true_in_time_is_a_success(reliability: Reliability) -> None:
    reliability.on_action(_action())
    reliability.judge(RED, 10**9)
    before = _counts(reliability)
    reliability.judge(GREEN, 2 * 10**9)

    assert before == (0, 0, 0.5)
    assert _counts(reliability) == (1, 1, 1.0)


def test_a_result_that_does_not_is_a_failure(reliability: Reliability) -> None:
    reliability.on_action(_action())
    reliability.judge(GREEN, 10**9)
    reliability.on_action(_action(1.0))
    reliability.judge(RED, 4 * 10**9)

    assert _counts(reliability) == (2, 1, 0.5)


def test_a_scheme_that_is_chosen_again_is_judged_from_when_it_was_first(
    reliability: Reliability,
) -> None:
    reliability.on_action(_action())
    reliability.on_action(_action(1.5))
    reliability.on_action(_action(2.0, scheme=""))
    reliability.judge(RED, 21 * 10**8)

    assert _counts(reliability) == (1, 0, 0.0)


def test_what_another_scheme_interrupts_is_not_counted(reliability: Reliability) -> None:
    reliability.on_action(_action())
    reliability.on_action(_action(scheme="other"))
    reliability.judge(GREEN, 10**9)

    assert _counts(reliability) == (0, 0, 0.5)


def test_what_was_learned_is_restored(reliability: Reliability, tmp_path: Path) -> None:
    reliability.on_action(_action())
    reliability.judge(GREEN, 10**9)
    noted = reliability.noted(Behaviour(scheme="follow", activation=1.0))
    restarted = Reliability([scheme_of(tmp_path, FOLLOW)])
    forgotten = Behaviour(scheme="not in the file any longer", activation=0.0, executions=3)

    restarted.restore([noted, forgotten])

    assert _counts(restarted) == (1, 1, 1.0)
