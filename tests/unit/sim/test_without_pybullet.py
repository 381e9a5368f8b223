"""Drives that render nothing, where pybullet cannot be imported."""

from __future__ import annotations

import subprocess
import sys

import pytest

WITHOUT = "import sys; sys.modules['pybullet'] = None\n"
DRIVE = """
from cogmap.schemas.sensing import MotorCommand, Percepts
from cogmap.services import registry

module = registry.build("sim", {"sim": settings, "run": {"lockstep": True}})
messages = module.stamp(module.start())
for _ in range(20):
    (seen,) = [message for message in messages if isinstance(message, Percepts)]
    command = MotorCommand(
        stamp_ns=seen.stamp_ns, left_wheel_rad_s=10.0, right_wheel_rad_s=10.0
    )
    messages = module.feed(command)
print(seen.frame)
"""
BUILD = """
from cogmap.errors import UsageError
from cogmap.services import registry

try:
    registry.build("sim", {})
except UsageError as error:
    print(error)
"""
TOWN = {"sensing": "percepts", "town": "blocks", "town_size_m": 120.0}
LINE = {
    "trajectory": {
        "line_m": [[0.0, 0.0], [60.0, 0.0]],
        "landmarks": [{"name": "house", "x_m": 30.0, "y_m": 12.0}],
    },
}


def _printed(program: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT + program], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


@pytest.mark.parametrize("settings", [TOWN, LINE], ids=["town", "line"])
def test_a_drive_at_the_level_of_percepts_needs_no_pybullet(settings: dict[str, object]) -> None:
    assert _printed(f"settings = {settings!r}\n{DRIVE}") == "19"


def test_cameras_without_pybullet_are_refused_in_one_sentence() -> None:
    said = _printed(BUILD)

    assert said.startswith("rendering needs pybullet, which has wheels for Python 3.11")
    assert "cogmap run --tour" in said
    assert "\n" not in said
