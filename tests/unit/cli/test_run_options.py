"""Options of `cogmap run`: their ranges, and what they are without being given."""

from __future__ import annotations

import click
import pytest

from cli.options import FiniteRange
from cli.run.command import LAP_LIMIT_S, default_limit_s


def test_the_time_limit_grows_with_the_laps_and_is_one_laps_at_least() -> None:
    of_one_lap = default_limit_s({"town": "loop", "laps": 1.0})
    of_two_laps = default_limit_s({"town": "loop", "laps": 2.0})
    of_a_short_drive = default_limit_s({"town": "loop", "laps": 0.05})

    assert of_one_lap == LAP_LIMIT_S
    assert of_two_laps == 2 * LAP_LIMIT_S
    assert of_a_short_drive == LAP_LIMIT_S


def test_without_a_route_the_time_limit_is_the_drives_duration_and_more() -> None:
    sim = {"town": "blocks", "laps": 5.0, "duration_s": 60.0}

    assert 60.0 < default_limit_s(sim) < 120.0


@pytest.mark.parametrize("number", ["nan", "inf", "-1"])
def test_a_number_that_is_not_finite_or_out_of_range_is_refused(number: str) -> None:
    with pytest.raises(click.BadParameter):
        FiniteRange(min=0).convert(number, None, None)


def test_a_number_in_range_is_taken() -> None:
    assert FiniteRange(min=0).convert("2.5", None, None) == 2.5
