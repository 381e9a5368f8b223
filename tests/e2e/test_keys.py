"""A whole drive with keys: every process has its own, and nobody gets in without."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.access import latency
from tests.support.system.runs import DRIVING, TIMEOUT_S, Run, answered

DRIVE = ("--lockstep", "--set", "sim.sensing=percepts", "--laps", "0.2")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The keys of a site, as `cogmap keys make` makes them."""
    made = tmp_path / "keys"
    command = [sys.executable, "-m", "cogmap.cli.main", "keys", "make", str(made)]
    subprocess.run(command, check=True, capture_output=True, timeout=TIMEOUT_S)
    return made


def test_a_drive_with_keys_reaches_its_goals_and_loses_nothing(
    folder: Path, start: Callable[..., Run]
) -> None:
    run = start(*DRIVE, "--keys", str(folder))

    assert run.end() == 0, run.output()
    summary = run.summary()
    assert summary["gaps_total"] == 0
    assert summary["log"]["never_drop_whole"]
    assert summary["killed"] == []


def test_commands_reach_a_drive_with_keys_by_their_own_alone(
    folder: Path, tmp_path: Path, start: Callable[..., Run]
) -> None:
    watching = tmp_path / "watching"
    shutil.copytree(folder / "observer", watching / "observer")
    run = start(*DRIVE, "--laps", "20", "--keys", str(folder))
    run.wait_for(DRIVING)

    def asked(*words: str) -> subprocess.CompletedProcess[str]:
        return answered(words[0], run.endpoint, *words[1:])

    by_observer = ("--keys", str(watching))
    seen = asked("topic", "echo", "motor/command", "--once", *by_observer)
    assert seen.returncode == 0, seen.stderr
    assert "left_wheel_rad_s" in seen.stdout

    listed = asked("node", "list", *by_observer)
    assert "global_workspace" in listed.stdout.split()

    goal = asked("goal", "home", *by_observer)
    assert goal.returncode == 2
    assert "has no keys of operator, but of observer" in goal.stderr

    given = asked("goal", "20", "0", "--keys", str(folder))
    assert given.returncode == 0, given.stderr

    stranger = asked("topic", "echo", "motor/command", "--once")
    assert stranger.returncode == 2
    assert "asks for keys: name their folder with --keys" in stranger.stderr


def test_messages_are_timed_with_keys_and_without(tmp_path: Path) -> None:
    measured = latency.measure(tmp_path, messages=10)

    assert measured["latency_over_plain"] > 0
    assert measured["delta_latency_over_plain"] > 0
