"""The EGL plugin, which renders several times faster than TinyRenderer, where it works."""

from __future__ import annotations

import importlib.util
import threading

from cogmap.errors import CogmapError
from cogmap.services.sim.stdio import pybullet, quiet

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
        """Load the plugin into `client`; return None if there is none. Raises CogmapError if one is
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
