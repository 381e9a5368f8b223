"""Signals while a process asks whether to end, and after."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from cogmap.runtime.process import Stop


def test_a_signal_asks_to_end_until_the_stop_is_released() -> None:
    before = signal.getsignal(signal.SIGINT)
    stop = Stop()

    signal.raise_signal(signal.SIGINT)
    assert stop.asked

    stop.release()
    assert signal.getsignal(signal.SIGINT) == before


@pytest.mark.parametrize(
    "hang",
    [
        pytest.param("threading.Event().wait()", id="in-python"),
        pytest.param("ctypes.PyDLL(None).pause()", id="in-a-library-that-keeps-python-waiting"),
    ],
)
def test_a_tied_process_that_hangs_ends_a_while_after_its_parent_and_says_where(hang: str) -> None:
    script = (
        "import ctypes\n"
        "import threading\n"
        "from cogmap.runtime import process\n"
        "def hang():\n"
        f"    {hang}\n"
        "process.END_GRACE_S = 0.1\n"
        "process.Stop(tied=True).wait()\n"
        "hang()\n"
    )

    hanging = subprocess.run(
        [sys.executable, "-c", script], input=b"", check=False, timeout=30, capture_output=True
    )

    assert hanging.returncode == 1
    assert b"in hang" in hanging.stderr
