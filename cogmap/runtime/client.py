"""A module beside a running system, on a thread of this process: for notebooks and tests."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from types import TracebackType

from cogmap.bus.access.subjects import ACTS
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.runtime import environment
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.succession import is_single

# How often it looks whether it is to end.
IDLE_S = 0.05


class Client:
    """Runs `module` on a thread of its own while in a `with` statement.

    It is connected to the router at `endpoint`, as one of `agent`'s; by default to the router at
    $COGMAP_CONNECT, as one of $COGMAP_AGENT's, as the modules are. Raises NoRouterError if none
    answers. With $COGMAP_KEYS it has the keys of the first of `subjects`, by default those of the
    operator, which a module called `notebook` may use; raises AccessError without them. Handlers
    are called on that thread; what ends it early is raised at the end.

        graph = Graph()
        with Client(Module("notebook").following(graph)):
            input("Enter ends it")
        print(len(graph.nodes))
    """

    def __init__(
        self,
        module: Module,
        endpoint: str | None = None,
        agent: str | None = None,
        subjects: Sequence[str] = ACTS,
    ) -> None:
        self.module = module
        self._subjects = subjects
        self._endpoint = endpoint or environment.endpoint()
        self._agent = agent or environment.agent()
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._error: Exception | None = None

    def __enter__(self) -> Client:
        keys = environment.keys(*self._subjects)
        shell = Shell(self.module, ZenohBus(self._endpoint, self._agent, keys=keys))
        try:
            shell.open(is_single=is_single(self.module))
        except BaseException:
            shell.close()
            raise
        self._ended.clear()
        self._thread = threading.Thread(target=self._work, args=(shell,), daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
        self.check()

    def check(self) -> None:
        """Raise what has ended the module, if something has."""
        if self._error is not None:
            raise self._error

    def _work(self, shell: Shell) -> None:
        try:
            while not self._ended.is_set():
                shell.spin_once(IDLE_S)
        except Exception as error:
            self._error = error
        finally:
            shell.close()
