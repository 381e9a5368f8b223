"""The robot's clock and ours."""

from __future__ import annotations

import pytest

from cogmap.errors import MessageError
from cogmap.ros2.stamps import LEAD_NS, Stamps

S = 10**9
DAY = 1_700_000_000 * S


def test_time_begins_with_the_first_stamp_and_leads_back() -> None:
    stamps = Stamps()

    assert stamps.of(DAY, wall_ns=5) == LEAD_NS
    assert stamps.of(DAY + S, wall_ns=6) == LEAD_NS + S
    assert stamps.on_robot(LEAD_NS + S) == DAY + S


def test_no_time_passes_before_the_first_stamp() -> None:
    stamps = Stamps()

    assert stamps.now_ns(77_000 * S) == 0
    stamps.of(DAY, 77_001 * S)
    assert stamps.now_ns(77_001 * S) == LEAD_NS


def test_time_passes_between_stamps_and_never_goes_back() -> None:
    stamps = Stamps()
    stamps.of(DAY, wall_ns=10 * S)
    assert stamps.now_ns(13 * S) == LEAD_NS + 3 * S

    stamps.of(DAY + S, wall_ns=13 * S)  # it comes late
    assert stamps.now_ns(13 * S) == LEAD_NS + 3 * S
    assert stamps.now_ns(16 * S) == LEAD_NS + 4 * S


def test_a_stamp_may_be_overtaken_but_not_be_of_another_clock() -> None:
    stamps = Stamps()
    stamps.of(DAY, 0)
    stamps.of(DAY + 3 * S, 0)

    assert stamps.of(DAY + 2 * S, 0) == LEAD_NS + 2 * S
    with pytest.raises(MessageError, match=r"goes back by 3\.0 s"):
        stamps.of(DAY, 0)
