"""`cogmap.run` as a script or a notebook calls it: real processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import cogmap
from cogmap.bus.session import free_endpoint
from tests.support.system.runs import DRIVING, TIMEOUT_S, processes_at

SHORT = {"sim.duration_s": 4.0, "sim.sensing": "percepts", "sim.town_size_m": 120.0}
INTERRUPTED = """
import sys
import cogmap
try:
    cogmap.run(connect=sys.argv[1], quiet=False)
except KeyboardInterrupt:
    print("ended by Ctrl-C")
"""


def test_a_drive_from_a_thread_returns_its_summary_and_its_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    endpoint = free_endpoint()
    with ThreadPoolExecutor() as pool:
        run = pool.submit(
            cogmap.run, town="blocks", lockstep=True, connect=endpoint, settings=SHORT
        ).result()

    written = json.loads((run.folder / "summary.json").read_text())
    assert run.summary.completed
    assert run.summary.estimate.mean_m == written["estimate"]["mean_m"]
    assert run.summary.lockstep
    assert run.log().errors().num_rows == run.summary.estimates > 5
    assert Path("runs/latest").resolve() == run.folder.resolve()
    assert capfd.readouterr() == ("", "")
    assert processes_at(endpoint) == []


def test_ctrl_c_ends_a_script_and_the_processes_of_its_drive(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONUNBUFFERED": "1"}
    script = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, endpoint],
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert script.stdout is not None
    for line in script.stdout:
        if DRIVING in line:
            break
    script.send_signal(signal.SIGINT)
    rest, _ = script.communicate(timeout=TIMEOUT_S)

    assert "ended by Ctrl-C" in rest
    assert script.returncode == 0
    assert processes_at(endpoint) == []


def test_an_option_that_does_not_fit_is_a_usage_error(tmp_path: Path) -> None:
    with pytest.raises(cogmap.UsageError, match="-1 is not in the range"):
        cogmap.run(seed=-1, out=tmp_path / "run")
