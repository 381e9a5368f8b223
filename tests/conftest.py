"""Keeps coverage cheap: a test is traced for its first moments only.

Python 3.11 takes half as long again while it is traced. A test that takes long repeats the lines of
its first moments, as drives and solvers are loops.
"""

from __future__ import annotations

import signal
from collections.abc import Generator

import pytest

TRACED_CPU_S = 0.2


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Stop tracing when the test has used its share of CPU time, until it ends."""
    plugin = item.config.pluginmanager.getplugin("_cov")
    controller = getattr(plugin, "cov_controller", None)
    if controller is None:
        return (yield)

    paused = False

    def pause(*_: object) -> None:
        nonlocal paused
        paused = True
        controller.cov.stop()

    signal.signal(signal.SIGVTALRM, pause)
    signal.setitimer(signal.ITIMER_VIRTUAL, TRACED_CPU_S)
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        if paused:
            controller.cov.start()
