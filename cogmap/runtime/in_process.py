"""Many modules in one Python process, on the in-memory bus: experiments, replay, tests."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell


class InProcessRunner:
    """Runs modules in turn on one thread, each message to its end, so that a run depends on its
    seeds alone.
    """

    def __init__(self, modules: Iterable[Module]) -> None:
        self.network = MemoryNetwork()
        self.shells = [Shell(module, MemoryBus(self.network), health=False) for module in modules]
        for shell in self.shells:
            shell.open()

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Go on until `until` says so, or nobody has anything left to do."""
        while not until():
            idle = True
            for shell in self.shells:
                while shell.spin_once(0.0):
                    idle = False
            if idle:
                return

    def close(self) -> None:
        """End every module."""
        for shell in self.shells:
            shell.close()
