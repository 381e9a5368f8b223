"""Goals as a person gives them: to a run, and to a running system, real processes over Zenoh."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from cogmap.bus.session import free_endpoint
from tests.support.system.runs import DRIVING, Run, answered

PERCEPTS = (
    "--lockstep",
    *("--town", "blocks"),
    *("--set", "sim.sensing=percepts"),
    *("--set", "sim.town_size_m=120"),
)


@pytest.fixture
def goals_file(tmp_path: Path) -> Path:
    path = tmp_path / "goals.txt"
    path.write_text("12 0\n", "utf-8")
    return path


def test_a_run_ends_when_the_agent_was_at_every_goal(
    start: Callable[..., Run], goals_file: Path
) -> None:
    run = start(*PERCEPTS, "--goals", str(goals_file))

    assert run.end() == 0, run.output()
    summary = run.summary()
    assert summary["ended_by"] == "route complete"
    assert "every goal" in summary["reason"]
    assert 8.0 < summary["distance_m"] < 60.0


def test_a_goal_given_to_a_running_system_is_planned(start: Callable[..., Run]) -> None:
    run = start(*PERCEPTS)
    run.wait_for(DRIVING)
    given = answered("goal", run.endpoint, "-25", "0", "--json", "--wait", "30")

    assert given.returncode == 0, given.stderr
    plan = json.loads(given.stdout)
    assert plan["goals"] == ["-25,0"]
    assert plan["length_m"] > 0.0


def test_a_goal_that_nobody_knows_is_said_and_the_command_fails(
    start: Callable[..., Run],
) -> None:
    run = start(*PERCEPTS)
    run.wait_for(DRIVING)
    given = answered("goal", run.endpoint, "harbour", "--wait", "30")

    assert given.returncode == 1
    assert given.stdout == "harbour: the map has no object of that name\n"


def test_without_a_system_the_remedy_is_named() -> None:
    given = answered("goal", free_endpoint(), "bakery", "--wait", "1")

    assert given.returncode != 0
    assert "cogmap run" in given.stderr
