"""Options of `cogmap run`: their ranges, and what they are without being given."""

from __future__ import annotations

import click
import pytest

from cogmap.cli.launch.plan import Choices
from cogmap.cli.options import FiniteRange
from cogmap.cli.run.execution import default_limit_s
from cogmap.cli.run.options import LAP_LIMIT_S
from cogmap.schemas.nodes import Goal


def test_the_time_limit_grows_with_the_laps_and_is_one_laps_at_least() -> None:
    sim = {"town": "loop", "duration_s": 900.0}
    of_one_lap = default_limit_s(sim, Choices(laps=1.0))
    of_two_laps = default_limit_s(sim, Choices(laps=2.0))
    of_a_short_drive = default_limit_s(sim, Choices(laps=0.05))

    assert of_one_lap == LAP_LIMIT_S
    assert of_two_laps == 2 * LAP_LIMIT_S
    assert of_a_short_drive == LAP_LIMIT_S


@pytest.mark.parametrize(
    ("town", "choices"),
    [
        ("blocks", Choices(laps=5.0)),
        ("loop", Choices(laps=5.0, goals=(Goal(id="goal:inn", object="inn"),))),
        ("loop", Choices(laps=5.0, tour=True)),
    ],
)
def test_without_laps_the_time_limit_is_the_drives_duration_and_more(
    town: str, choices: Choices
) -> None:
    sim = {"town": town, "duration_s": 60.0}

    assert 60.0 < default_limit_s(sim, choices) < 120.0


@pytest.mark.parametrize("number", ["nan", "inf", "-1"])
def test_a_number_that_is_not_finite_or_out_of_range_is_refused(number: str) -> None:
    with pytest.raises(click.BadParameter):
        FiniteRange(min=0).convert(number, None, None)


def test_a_number_in_range_is_taken() -> None:
    assert FiniteRange(min=0).convert("2.5", None, None) == 2.5
