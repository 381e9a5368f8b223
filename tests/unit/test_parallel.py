"""Jobs in processes of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from cogmap.parallel import parallel_map

SLOW = """
import sys, time
from cogmap.parallel import parallel_map
if __name__ == "__main__":
    parallel_map(print, ["there"] * 2, 2)
    print("waiting", flush=True)
    parallel_map(time.sleep, [60.0] * 4, 2)
"""


def _children(pid: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        try:
            facts = (entry / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if entry.name.isdigit() and int(facts[1]) == pid:
            found.append(int(entry.name))
    return found


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_results_come_in_the_order_of_the_jobs_and_progress_reaches_one() -> None:
    shares: list[float] = []
    results = parallel_map(abs, [-3, 2, -1], 2, shares.append)

    assert results == [3, 2, 1]
    assert shares[-1] == 1.0
    assert shares == sorted(shares)


def _await(ended: Path | None) -> bool:
    """Wait for a file, if one is given."""
    deadline_s = time.monotonic() + 30
    while ended is not None and not ended.exists():
        assert time.monotonic() < deadline_s
    return ended is None


def test_progress_follows_each_job_that_ends_before_an_earlier_one(tmp_path: Path) -> None:
    ended = tmp_path / "ended"
    shares: list[float] = []

    def progress(share: float) -> None:
        shares.append(share)
        ended.touch()

    assert parallel_map(_await, [ended, None], 2, progress) == [False, True]
    assert shares == [0.5, 1.0]


def test_nothing_is_left_of_the_processes_of_one_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "slow.py"
    script.write_text(SLOW)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}
    process = subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=environment
    )
    assert process.stdout is not None

    while process.stdout.readline() != "waiting\n":
        assert process.poll() is None

    deadline_s = time.monotonic() + 30
    while len(_children(process.pid)) < 3:  # two at work, and Python's own tracker
        assert time.monotonic() < deadline_s
    children = _children(process.pid)

    process.send_signal(signal.SIGKILL)
    process.wait()
    while any(_alive(child) for child in children):
        assert time.monotonic() < deadline_s + 30, "a process goes on without its parent"
    process.stdout.close()
