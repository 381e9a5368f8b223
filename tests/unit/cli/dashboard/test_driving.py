"""The keys of a page, and the workers that a person adds or kills, where nothing runs."""

from __future__ import annotations

import pytest

from cogmap.bus.session import free_endpoint
from cogmap.cli.dashboard.driving import Driving
from cogmap.cli.dashboard.workers import Workers
from cogmap.errors import UsageError


def test_a_key_that_leads_nowhere_is_refused_with_those_that_drive() -> None:
    with pytest.raises(UsageError, match="arrows drive"):
        Driving(free_endpoint(), "agent").press("x")


def test_a_robot_that_is_not_driven_can_be_left() -> None:
    assert Driving(free_endpoint(), "agent").press("q") == "the robot is left alone"


def test_a_worker_that_does_not_run_here_is_not_killed() -> None:
    with pytest.raises(UsageError, match="on its own machine"):
        Workers(free_endpoint(), "agent").kill("codelets-1")
