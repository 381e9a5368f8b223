"""What the doctor says of a system that starts, ends, or runs on a machine that is too slow."""

from __future__ import annotations

from dataclasses import replace

import pytest
from msgspec import structs

from cogmap.bus.discovery import System
from cogmap.bus.interface import Member
from cogmap.cli.doctor import moment, system
from cogmap.cli.doctor.finding import Finding
from cogmap.cli.doctor.observed import Observed
from cogmap.cli.launch.plan import OBSERVER
from cogmap.schemas import topics
from cogmap.schemas.process import Health
from cogmap.schemas.sensing import MotorCommand, SpeedLimit
from tests.support.health import report

EXPECTED = ("sim", "epam", "motor")
SIM = Member("sim", "sim")
EPAM = Member("epam", "epam")
MOTOR = Member("motor", "motor")
DRIVE = Member(OBSERVER, OBSERVER)
SILENT = Finding("epam", "it is on the bus but reports nothing", "see its log")


def told(observed: Observed) -> str:
    return str(moment.passing(EXPECTED, observed) or "")


def reported(uptime_s: float, ready: bool = True) -> dict[str, list[Health]]:
    return {"sim": [report("sim", uptime_s, ready)]}


def test_a_system_that_runs_is_neither_starting_nor_ending() -> None:
    assert not told(Observed({SIM, EPAM, MOTOR}, reported(uptime_s=10.0)))


def test_whoever_is_missing_in_the_beginning_may_still_come() -> None:
    young = Observed({SIM, EPAM}, reported(uptime_s=10.0, ready=False))
    old = Observed({SIM, EPAM}, reported(uptime_s=100.0, ready=False))
    moving = Observed({SIM, EPAM}, reported(uptime_s=10.0))

    assert told(young).startswith("system: it is starting; not ready yet: motor, sim")
    assert not told(old)
    assert not told(moving)


@pytest.mark.parametrize("left", [{DRIVE}, {SIM, MOTOR}], ids=["its drive", "several"])
def test_a_system_whose_modules_leave_is_ending(left: set[Member]) -> None:
    ending = Observed({SIM, EPAM, MOTOR} - left, reported(uptime_s=100.0), left=left)

    assert told(ending).startswith("system: it is ending")


def test_one_module_that_leaves_has_died() -> None:
    assert not told(Observed({EPAM, MOTOR}, reported(uptime_s=100.0), left={SIM}))


def test_whoever_comes_back_has_not_left() -> None:
    observed = Observed()
    for alive in (True, False, True):
        observed.note(SIM, alive)

    assert observed.ready == {SIM}
    assert not observed.left


def test_a_router_alone_is_no_system() -> None:
    assert told(Observed()).startswith("system: no module is on the bus")


def test_what_is_late_where_all_processors_are_busy_is_the_machines() -> None:
    busy = Observed({SIM}, busy=0.99)

    (finding,) = moment.slow_machine(busy, [SILENT])

    assert str(finding).startswith("machine: it is too slow for real time: its processors")
    assert f"epam: {SILENT.wrong}" in finding.wrong
    assert moment.slow_machine(replace(busy, busy=0.5), [SILENT]) == []
    assert moment.slow_machine(busy, []) == []


def test_old_poses_are_the_machines() -> None:
    observed = Observed({SIM})
    for limit in (SpeedLimit.POSE_AGE, SpeedLimit.NONE):
        observed.add(MotorCommand(left_wheel_rad_s=0.0, right_wheel_rad_s=0.0, slowed_by=limit))

    (finding,) = moment.slow_machine(observed, [])

    assert "50% of its poses are old" in finding.wrong


def test_commands_that_came_too_late_are_the_machines() -> None:
    refused = structs.replace(
        reported(uptime_s=100.0)["sim"][0], rejected={topics.MOTOR_COMMAND.name: 2}
    )
    slow = Observed({SIM}, {"sim": [refused]}, commands=10, limited=10)
    nothing = System("agent", (), ())

    findings = system.examine(["sim"], slow, nothing)
    well = system.examine(["sim"], replace(slow, limited=0), nothing)

    assert [finding.about for finding in findings] == ["machine"]
    assert [finding.about for finding in well] == ["sim"]
