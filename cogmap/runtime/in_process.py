"""Many modules in one Python process, on the in-memory bus: experiments, notebooks, tests."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import TracebackType

from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell


class InProcessRunner:
    """Runs modules in turn on one thread, each message to its end.

    A run depends on the modules' seeds alone. Use it in a `with` statement, or `close()` it.

        observer = Module("observer").on(topics.MOTOR_COMMAND, commands.append)
        with InProcessRunner([mapper, planner, observer]) as runner:
            runner.run(until=lambda: len(commands) >= 20)
    """

    def __init__(self, modules: Iterable[Module]) -> None:
        self.network = MemoryNetwork()
        self.shells = [Shell(module, MemoryBus(self.network), health=False) for module in modules]
        for shell in self.shells:
            shell.open()

    def __enter__(self) -> InProcessRunner:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Run until `until()` is true, or no message is left to process."""
        moved = True
        while moved and not until():
            moved = False
            for shell in self.shells:
                while shell.spin_once():
                    moved = True

    def close(self) -> None:
        """End every module."""
        for shell in self.shells:
            shell.close()
