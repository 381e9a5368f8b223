"""Signals while a process asks whether to end, and after."""

from __future__ import annotations

import signal

from cogmap.runtime.process import Stop


def test_a_signal_asks_to_end_until_the_stop_is_released() -> None:
    before = signal.getsignal(signal.SIGINT)
    stop = Stop()

    signal.raise_signal(signal.SIGINT)
    assert stop.asked

    stop.release()
    assert signal.getsignal(signal.SIGINT) == before
