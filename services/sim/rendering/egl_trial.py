"""Whether the EGL plugin works here, tried in a process of its own.

It imports nothing of the simulation, so that it can begin before anything else does.
"""

from __future__ import annotations

import ctypes
import socket
import subprocess
import sys
from functools import cache

_PROBE = """
import importlib.util, os, pybullet, sys
pybullet.connect(pybullet.DIRECT)
plugin = importlib.util.find_spec("eglRenderer").origin
if pybullet.loadPlugin(plugin, "_eglRendererPlugin") >= 0:
    os.write(int(sys.argv[1]), b"1")
"""
# A bound for a driver that hangs: the plugin then counts as one that does not work.
_PROBE_S = 20.0


class Trial:
    """The plugin, tried in a process of its own: where there is no driver, that exits.

    Begin it early: it takes a while, and counts in a process that this one forks meanwhile too.
    """

    def __init__(self) -> None:
        self._outcome, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _PROBE, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
            )

    def succeeds(self) -> bool:
        """Wait for the trial, and decide whether the plugin loads here."""
        self._outcome.settimeout(_PROBE_S)
        try:
            # It stays there for the next process that asks.
            outcome = self._outcome.recv(1, socket.MSG_PEEK)
        except TimeoutError:
            self._process.kill()
            outcome = b""

        self._process.wait()
        return outcome != b""


@cache
def trial() -> Trial | None:
    """Try the plugin, unless that has begun; return None if there is nothing to try."""
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        return None
    return Trial()


@cache
def works() -> bool:
    """Decide whether the plugin loads here."""
    begun = trial()
    return begun is not None and begun.succeeds()
