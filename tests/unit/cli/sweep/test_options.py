"""What the options of a sweep mean."""

from __future__ import annotations

import pytest

from cogmap.cli.sweep.options import every_variant, read_seeds
from cogmap.errors import UsageError


def test_seeds_are_numbers_and_ranges() -> None:
    assert read_seeds("1-3, 8,5-5") == [1, 2, 3, 8, 5]


@pytest.mark.parametrize("text", ["", "1-x", "-3", "5-1", "0-99999"])
def test_what_is_no_seed_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=f"--seeds {text}: "):
        read_seeds(text)


def test_every_combination_of_values_is_driven() -> None:
    read = every_variant(["sim.seed=1, 2", "sim.town=loop,blocks", "a.b=[1, 2], 'x,y'"])

    assert len(read) == 8
    assert read[0] == {"sim.seed": 1, "sim.town": "loop", "a.b": [1, 2]}
    assert read[-1] == {"sim.seed": 2, "sim.town": "blocks", "a.b": "x,y"}
