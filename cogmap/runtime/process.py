"""A process with one module in it, or with the router."""

from __future__ import annotations

import faulthandler
import logging
import os
import signal
import sys
import threading
from pathlib import Path
from types import FrameType

from cogmap.bus.access.subjects import ROUTER
from cogmap.bus.session import EXPOSED, check_name, from_here, is_exposed, open_router
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.heap import keep_freed_memory
from cogmap.runtime import environment
from cogmap.runtime.company import company_at, watch_company
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state import published
from cogmap.runtime.state.journal import Journal
from cogmap.runtime.state.outbox import Outbox
from cogmap.runtime.state.published import PublishedCounts
from cogmap.runtime.state.store import Store
from cogmap.runtime.succession import is_single

log = logging.getLogger("cogmap")
# How often it looks whether it is asked to end.
IDLE_S = 0.25
# Added to the niceness, which ends at 19.
PATIENT = 10
# To end in order; whoever started it would wait as long.
END_GRACE_S = 10.0
STANDARD_ERROR = 2


class Stop:
    """Whether this process has been asked to end: by a signal or, where it is `tied`, by the end of
    its parent.
    """

    def __init__(self, tied: bool = False) -> None:
        self._asked = threading.Event()
        self._handlers_before = {
            number: signal.signal(number, self._on_signal)
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        }
        if tied:
            threading.Thread(target=self._watch_parent, daemon=True).start()

    @property
    def asked(self) -> bool:
        """Return whether the process is to end."""
        return self._asked.is_set()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until asked; False after `timeout_s`."""
        return self._asked.wait(timeout_s)

    def release(self) -> None:
        """Leave signals to whoever had them before."""
        for number, handler in self._handlers_before.items():
            if handler is not None:
                signal.signal(number, handler)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._asked.set()

    def _watch_parent(self) -> None:
        # Not sys.stdin.read(): its lock would outlive the main thread.
        while os.read(sys.stdin.fileno(), 4096):
            pass
        _end_by_force()
        self._asked.set()


def await_line() -> bool:
    """Wait for a line on standard input. False if that ended before."""
    # Not sys.stdin, which would read ahead.
    while byte := os.read(sys.stdin.fileno(), 1):
        if byte == b"\n":
            return True
    return False


def give_way() -> None:
    """Let other processes go first if processors are scarce: no command waits for what this thread
    does, and those that it starts from now on.
    """
    os.nice(PATIENT)


def run_module(
    module: Module,
    endpoint: str | None = None,
    agent: str | None = None,
    state: Path | None = None,
    *,
    tied: bool = False,
    memory: Path | None = None,
    ends_with: str = "",
) -> None:
    """Run `module` as this process until a signal to end or, if it is `tied`, the end of its
    parent; or until the module `ends_with` has left the bus, or did not come.

    It connects to the router at `endpoint` as one of `agent`'s, by default those of $COGMAP_CONNECT
    and $COGMAP_AGENT; what it must keep is in the folder `state`, and what it remembers for later
    runs in the database `memory`. Raises NoRouterError, StorageError if that folder cannot be
    written or the database cannot be read, and UsageError for a name of an instance or an agent
    that cannot be part of a key.
    """
    check_name("--instance", module.instance)
    keep_freed_memory()
    if module.remembers:
        give_way()
    journal = None
    counts = None
    outbox = None
    if state is not None:
        outbox = Outbox(state / f"{module.instance}.outbox")
        counts = PublishedCounts(state / f"{module.instance}{published.SUFFIX}")
        if module.journal is not None:
            journal = Journal(state / f"{module.instance}.journal")

    store = Store(memory) if memory is not None and module.remembers else None
    bus = ZenohBus(
        endpoint or environment.endpoint(),
        agent or environment.agent(),
        keys=environment.keys(module.name),
    )
    stop = Stop(tied)  # only now: until a router answers, a signal ends the process at once
    shell = Shell(module, bus, journal, counts=counts, store=store, outbox=outbox)
    try:
        shell.open(is_single=is_single(module), is_asked_to_end=lambda: stop.asked)
        log.info("%s is ready", module.instance)
        is_alone = watch_company(bus, ends_with)
        while not stop.asked and not is_alone():
            shell.spin_once(IDLE_S)
    finally:
        shell.close()


def run_router(endpoint: str, stop: Stop, agent: str = "", ends_with: str = "") -> None:
    """Run a router until `stop` is asked, or until `agent`'s module `ends_with` has left the bus,
    or did not come. Raises PortInUseError, and AccessError if it has no keys where it should.
    """
    keys = environment.keys(ROUTER)
    session = open_router(endpoint, keys)
    log.info("router listens at %s", endpoint)
    if keys is None and is_exposed(endpoint):
        log.warning("%s", EXPOSED)
    with company_at(from_here(endpoint), agent, ends_with, keys) as is_alone:
        # Without a time limit, a signal that comes before it is not seen.
        while not stop.wait(IDLE_S) and not is_alone():
            pass
    _end_by_force()
    session.close()  # type: ignore[no-untyped-call]


def _end_by_force() -> None:
    """End this process after a while if something hangs, as closing a session may while others
    leave it: nobody may be left to end it. Where each of its threads hangs is written to standard
    error.

    No thread of Python's does it: a library that waits may keep all of them from running.
    """
    faulthandler.dump_traceback_later(END_GRACE_S, exit=True, file=STANDARD_ERROR)
