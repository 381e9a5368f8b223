"""What the body senses of itself, as a need in the Workspace."""

from __future__ import annotations

import pytest

from cogmap.runtime.run import LOCKSTEP, REAL_TIME, Run
from cogmap.schemas.nodes import Need, need_id
from cogmap.schemas.sensing import Energy
from cogmap.services.workspace.senses import Body


def energy(stamp_ns: int, level: float, is_charging: bool = False) -> Energy:
    """What was sensed at a time."""
    return Energy(stamp_ns=stamp_ns, frame=0, level=level, is_charging=is_charging)


def test_the_need_is_what_is_missing_of_the_energy_and_is_eased_by_charging() -> None:
    body = Body(REAL_TIME)
    body.put(energy(5, 0.25, is_charging=True))

    (need,) = body.needs(5, cycle=3)

    assert (need.id, need.label, need.cycle) == (need_id("energy"), "energy", 3)
    assert need.level == need.activation == 0.75
    assert need.is_eased


def test_a_body_that_senses_no_energy_needs_none() -> None:
    assert Body(REAL_TIME).needs(5, cycle=3) == []


def test_in_real_time_the_newest_before_the_view_counts() -> None:
    body = Body(REAL_TIME)
    for stamp_ns, level in ((5, 0.9), (7, 0.8), (9, 0.7)):
        body.put(energy(stamp_ns, level))

    assert body.has(100)
    assert _level(body.needs(8, cycle=1)) == pytest.approx(0.2)


def test_in_lockstep_a_cycle_waits_for_the_energy_of_its_view_of_a_battery() -> None:
    awaiting = Body(Run(lockstep=True, energy=True))
    awaiting.put(energy(5, 0.9))

    assert awaiting.has(5)
    assert not awaiting.has(7)
    assert Body(LOCKSTEP).has(7)


def _level(needs: list[Need]) -> float:
    (need,) = needs
    return need.level
