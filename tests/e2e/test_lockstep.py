"""Two drives of one seed in lockstep, through real processes, Zenoh and two workers: the same bytes
on every topic.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from cogmap.bus.session import free_endpoint
from cogmap.recording.diff import diff

TIMEOUT_S = 90.0


def _drive(folder: Path, workers: int) -> Path:
    command = [
        sys.executable,
        "-m",
        "cli.main",
        "run",
        "--lockstep",
        "--laps",
        "0.04",
        "--seed",
        "6",
    ]
    whole = [
        *command,
        "--codelets",
        str(workers),
        "--out",
        str(folder),
        "--connect",
        free_endpoint(),
    ]
    done = subprocess.run(whole, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads((folder / "summary.json").read_text())["gaps_total"] == 0
    return folder / "log.mcap"


def test_two_lockstep_drives_of_one_seed_say_the_same_bytes_on_every_topic(tmp_path: Path) -> None:
    logs = [_drive(tmp_path / name, workers=2) for name in ("first", "second")]
    compared = diff(*logs)
    assert compared.same, compared.first
    counts = {topic.topic: topic.same for topic in compared.topics}
    assert counts["motor/command"] == counts["epam/percepts"] > 10
