"""The EGL plugin, which renders several times faster than TinyRenderer, where it works."""

from __future__ import annotations

import ctypes
import importlib.util
import socket
import subprocess
import sys
import threading
from functools import cache

from cogmap.errors import CogmapError
from services.sim.stdio import pybullet, quiet

_PROBE = """
import importlib.util, os, pybullet, sys
pybullet.connect(pybullet.DIRECT)
plugin = importlib.util.find_spec("eglRenderer").origin
if pybullet.loadPlugin(plugin, "_eglRendererPlugin") >= 0:
    os.write(int(sys.argv[1]), b"1")
"""
_PROBE_S = 20.0
_ENTRY_POINT = "_eglRendererPlugin"


class Egl:
    """The plugin in one pybullet client.

    Its OpenGL context belongs to the thread that loaded it, and loading another takes that thread
    from it: a process has one at a time, or images would silently show something else.
    """

    _loaded = False

    def __init__(self, client: int, plugin: int) -> None:
        self._client = client
        self._plugin = plugin
        self._thread = threading.get_ident()

    @classmethod
    def load(cls, client: int) -> Egl | None:
        """The plugin, loaded into `client`; None if there is none. Raises CogmapError if one is
        loaded already.
        """
        if cls._loaded:
            raise CogmapError(
                "a simulated world is open in this process: close it before opening another"
            )

        found = importlib.util.find_spec("eglRenderer")
        if found is None or found.origin is None:
            return None

        with quiet():
            plugin = pybullet.loadPlugin(found.origin, _ENTRY_POINT, physicsClientId=client)

        if plugin < 0:
            return None

        cls._loaded = True

        return cls(client, int(plugin))

    def check(self) -> None:
        """Raise CogmapError on another thread than the one that loaded it."""
        if threading.get_ident() != self._thread:
            raise CogmapError(
                "images are rendered on the thread that opened the simulated world: open it there"
            )

    def unload(self) -> None:
        """Unload it from the client."""
        pybullet.unloadPlugin(self._plugin, physicsClientId=self._client)
        type(self)._loaded = False


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
        """Whether the plugin loads here."""
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
    """Try the plugin, unless that has begun; None where there is nothing to try."""
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        return None
    return Trial()


@cache
def works() -> bool:
    """Whether the plugin loads here."""
    begun = trial()
    return begun is not None and begun.succeeds()
