"""Signals while a process asks whether to end, and after."""

from __future__ import annotations

import signal
import subprocess
import sys

from cogmap.runtime.process import Stop


def test_a_signal_asks_to_end_until_the_stop_is_released() -> None:
    before = signal.getsignal(signal.SIGINT)
    stop = Stop()

    signal.raise_signal(signal.SIGINT)
    assert stop.asked

    stop.release()
    assert signal.getsignal(signal.SIGINT) == before


def test_a_tied_process_that_hangs_ends_a_while_after_its_parent() -> None:
    script = (
        "import threading\n"
        "from cogmap.runtime import process\n"
        "process.END_GRACE_S = 0.1\n"
        "process.Stop(tied=True)\n"
        "threading.Event().wait()\n"
    )

    hanging = subprocess.run([sys.executable, "-c", script], input="", check=False, timeout=60)

    assert hanging.returncode == 1
