"""Processes that a fork server starts for a supervisor."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from types import TracebackType
from typing import IO

import msgspec

from cogmap.cli.launch.command_line import environment
from cogmap.cli.launch.forking.server import MAX_BYTES, Report, Request, report_decoder

# Room for the command lines of those that are forked: see `show_command_line`.
_ROOM = " " * 4096
UNKNOWN_CODE = -signal.SIGKILL
"""As of one that was killed: it is started again."""

_SERVER = (sys.executable, "-P", "-m", "cogmap.cli.launch.forking.server")


class Forked:
    """A process that a fork server was asked for, with the interface of subprocess.Popen.

    Its standard input is the pipe `stdin`. It outlives the server: its end is seen then, but not
    its exit code, in the place of which is UNKNOWN_CODE.
    """

    def __init__(self, server: ForkServer, stdin: IO[bytes]) -> None:
        self.stdin: IO[bytes] = stdin
        self.started: int | None = None
        self.code: int | None = None
        self._server = server
        self._handle: int | None = None
        self._is_orphan = False

    @property
    def pid(self) -> int:
        """Return the process id; 0 if it was never started, as the server has ended."""
        while self.started is None and self.code is None:
            self._receive(None)
        return self.started or 0

    def poll(self) -> int | None:
        """Return the exit code; None while it runs."""
        self._receive(0.0)
        return self.code

    def wait(self, timeout: float) -> int:
        """Wait for its end. Returns the exit code; raises TimeoutExpired."""
        deadline_s = time.monotonic() + timeout
        while self.code is None:
            left_s = deadline_s - time.monotonic()
            self._receive(max(0.0, left_s))
            if left_s <= 0 and self.code is None:
                raise subprocess.TimeoutExpired("cogmap", timeout)
        return self.code

    def terminate(self) -> None:
        """Send SIGTERM."""
        self._send(signal.SIGTERM, self.pid)

    def kill(self) -> None:
        """Send SIGKILL."""
        self._send(signal.SIGKILL, self.pid)

    def note(self, report: Report) -> None:
        """Take account of what the server reports of it."""
        self.started = report.pid
        self.code = report.code
        if self.code is None:
            with suppress(ProcessLookupError):  # its end is reported next
                self._handle = os.pidfd_open(report.pid)
        else:
            self._close_handle()

    def lose_server(self) -> None:
        """Take account that nobody reports its end any more; one that has not
        started never will."""
        self._is_orphan = True
        if self._handle is None:
            self.stdin.close()
            self.code = UNKNOWN_CODE

    def end(self) -> None:
        """Kill it."""
        self.stdin.close()
        self._send(signal.SIGKILL, self.started)
        self.code = UNKNOWN_CODE
        self._close_handle()

    def _receive(self, timeout_s: float | None) -> None:
        """Take account of what the server reports or, where that has ended, look oneself."""
        if not self._is_orphan:
            self._server.receive(timeout_s)
        elif self._handle is not None and _is_ready(self._handle, timeout_s):
            self.code = UNKNOWN_CODE
            self._close_handle()

    def _close_handle(self) -> None:
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None

    def _send(self, number: signal.Signals, pid: int | None) -> None:
        if self.code is None and pid:
            with suppress(ProcessLookupError):
                os.kill(pid, number)


class ForkServer:
    """A fork server in a process of its own, which ends with this one. Linux only.

    Where it has died, what it had started runs on, and another one is started; if it had started
    nothing, none is, for that would die too, and `is_alive` is False.
    """

    def __init__(self) -> None:
        self._forked: list[Forked] = []
        self.is_alive = False
        self._start()

    @property
    def pid(self) -> int:
        """Return the server's own process id."""
        return self._process.pid

    def fork(self, arguments: Sequence[str], output: int) -> Forked:
        """Start `cogmap` with `arguments`, printing to the file descriptor `output`, in a session
        of its own.
        """
        source, sink = os.pipe()
        forked = Forked(self, os.fdopen(sink, "wb"))
        request = Request(len(self._forked), list(arguments))
        self._forked.append(forked)

        try:
            socket.send_fds(self._channel, [msgspec.msgpack.encode(request)], [source, output])
        except OSError:
            self._replace()
        finally:
            os.close(source)
        return forked

    def receive(self, timeout_s: float | None) -> None:
        """Take account of what the server reports, waiting so long for the first."""
        while self.is_alive and _is_ready(self._channel.fileno(), timeout_s):
            payload = b""
            with suppress(ConnectionResetError):  # it has died before it read what it was asked for
                payload = self._channel.recv(MAX_BYTES)
            if not payload:
                self._replace()
                return

            report = report_decoder.decode(payload)
            self._forked[report.number].note(report)
            self._has_forked = True
            timeout_s = 0.0

    def close(self) -> None:
        """End the server, and what it started and has not ended."""
        self._end()
        for forked in self._forked:
            if forked.code is None:
                forked.end()

    def __enter__(self) -> ForkServer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _start(self) -> None:
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._has_forked = False
        self.is_alive = True
        with theirs:
            self._process = subprocess.Popen(
                [*_SERVER, str(theirs.fileno()), _ROOM],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=environment(),
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )

    def _end(self) -> None:
        self.is_alive = False
        self._channel.close()
        self._process.kill()
        self._process.wait()

    def _replace(self) -> None:
        """Start another server in the place of one that has died."""
        self._end()
        for forked in self._forked:
            if forked.code is None:
                forked.lose_server()

        if self._has_forked:
            self._start()


def fork_server() -> AbstractContextManager[ForkServer | None]:
    """Start a fork server; None if forking is not safe: libraries of macOS start threads."""
    return ForkServer() if sys.platform == "linux" else nullcontext()


def _is_ready(descriptor: int, timeout_s: float | None) -> bool:
    ready, _, _ = select.select([descriptor], [], [], timeout_s)
    return bool(ready)
