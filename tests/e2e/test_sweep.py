"""Sweeps of real drives."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

import cogmap
from cogmap.cli.run.script import summary_in
from tests.support.system.runs import COGMAP, TIMEOUT_S, processes_at, wait_until

SHORT = {"sim.duration_s": 3.0, "sim.sensing": "percepts", "sim.town_size_m": 120.0}
TOO_SMALL = SHORT | {"sim.town_size_m": 1.0}


def test_a_sweep_drives_once_and_names_what_failed(tmp_path: Path) -> None:
    def swept() -> cogmap.Sweep:
        variants = [SHORT, TOO_SMALL]
        return cogmap.sweep([1], variants, out=tmp_path, processes=2, town="blocks")

    first = swept()
    whole, failed = first.drives
    assert whole.summary is not None
    assert whole.summary.lockstep
    assert first.failed == [failed]
    assert "town_size_m" in failed.error

    before_ns = (whole.folder / "summary.json").stat().st_mtime_ns
    assert swept().rows() == first.rows()
    assert (whole.folder / "summary.json").stat().st_mtime_ns == before_ns


def test_ctrl_c_ends_a_sweep_and_keeps_what_was_driven(tmp_path: Path) -> None:
    settings = [word for key, value in SHORT.items() for word in ("--set", f"{key}={value}")]
    options = ["--seeds", "1-9", "--town", "blocks", "--out", str(tmp_path), *settings]
    command = subprocess.Popen([*COGMAP, "sweep", *options])
    wait_until(lambda: summary_in(tmp_path / "seed-1") is not None, "a drive has ended")
    wait_until(lambda: bool(processes_at(str(tmp_path / "seed-2"))), "the next one goes on")

    command.send_signal(signal.SIGINT)

    assert command.wait(TIMEOUT_S) == 130
    assert processes_at(str(tmp_path)) == []
    assert not (tmp_path / "seed-3").exists()
