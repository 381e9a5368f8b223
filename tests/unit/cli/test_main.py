"""The `cogmap` command itself: its version, its help, what it imports."""

from __future__ import annotations

import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

from cogmap.cli.experiment.command import experiment
from cogmap.cli.log.command import log
from cogmap.cli.main import VERBS, cogmap
from cogmap.cli.memory.command import memory
from cogmap.cli.topic.command import topic
from cogmap.cli.verbs import LazyCommand
from cogmap.cli.view.command import view
from cogmap.recording.storage.format import SOFTWARE

ALIASES = {"bag": "log"}
HEAVY = {"matplotlib", "cv2", "pybullet", "scipy"}


def test_version_is_the_one_that_logs_name_too() -> None:
    result = CliRunner().invoke(cogmap, ["--version"])

    assert result.output == f"{SOFTWARE}\n"


def test_help_lists_every_command_and_imports_none_of_them() -> None:
    script = (
        "import sys\n"
        "from cogmap.cli.main import cogmap\n"
        "cogmap(['--help'], standalone_mode=False)\n"
        "print(*sys.modules, file=sys.stderr)\n"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)

    listed = {line.split()[0] for line in run.stdout.splitlines() if line.startswith("  ")}
    imported = set(run.stderr.split())
    assert set(VERBS) <= listed
    assert imported & HEAVY == set()


ROWS = [
    pytest.param(command, id=f"{group.name} {command.name}")
    for group in (cogmap, experiment, log, memory, topic, view)
    for command in group.commands.values()
]


@pytest.mark.parametrize("row", ROWS)
def test_each_row_of_verbs_names_the_command_that_it_imports(row: click.Command) -> None:
    assert isinstance(row, LazyCommand)
    command = row.load()

    assert isinstance(command, click.Command)
    assert command.name == ALIASES.get(row.name, row.name)


def test_bag_is_another_name_of_log() -> None:
    by_alias = CliRunner().invoke(cogmap, ["bag", "--help"], prog_name="cogmap")
    by_name = CliRunner().invoke(cogmap, ["log", "--help"], prog_name="cogmap")

    assert by_alias.output == by_name.output.replace("cogmap log [", "cogmap bag [")


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["stret", "list"], "street"),
        (["topic", "ech"], "echo"),
        (["log", "inf"], "info"),
        (["experiment", "city-map"], "city-maps"),
    ],
)
def test_a_mistyped_verb_names_the_nearest(arguments: list[str], meant: str) -> None:
    result = CliRunner().invoke(cogmap, arguments)

    assert result.exit_code == 2
    assert f"Did you mean '{meant}'?" in result.output
