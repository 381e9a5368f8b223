"""The settings of a running system: real processes over Zenoh."""

from __future__ import annotations

import json
from collections.abc import Callable

from tests.support.system.runs import DRIVING, Run, answered

CRUISE = "motor.cruise_m_s"


def test_the_settings_are_those_that_a_drive_was_started_with(start: Callable[..., Run]) -> None:
    run = start(
        *("--lockstep", "--town", "blocks", "--set", "sim.sensing=percepts"),
        *("--set", "sim.town_size_m=120", "--set", f"{CRUISE}=1.25"),
    )
    run.wait_for(DRIVING)

    listed = json.loads(answered("param", run.endpoint, "list", "--json").stdout)

    assert listed["motor"]["cruise_m_s"] == 1.25
    assert listed["sim"]["town"] == "blocks"
    assert answered("param", run.endpoint, "get", CRUISE).stdout == "1.25\n"
    run.close()
