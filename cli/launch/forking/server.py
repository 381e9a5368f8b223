"""A fork server: imports what the programs of a run need, once, and forks a process for each.

It has one thread, no session and no device, of which a fork would have a part only.

The standard library's forkserver forks nothing before all is imported, so that the simulation,
whose world takes longest to build, would start last: a drive began a second later (6.9 s in place
of 5.9 s, on a machine of two busy cores). Nor does it end what it has forked when it is killed.
"""

from __future__ import annotations

import ctypes
import gc
import importlib
import os
import select
import socket
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import msgspec

from cogmap.cli.launch.command_line import cogmap_command
from cogmap.services import registry

COMMON = ("cogmap.cli.main", "cogmap.cli.processes")
RECORDING = ("cogmap.cli.log.command", "cogmap.cli.log.record")
MAX_BYTES = 65_536
"""Of a packet between the two ends: a command line has a few hundred."""
# Fields of /proc/PID/stat, counted from the third, which is the first after the name: see
# proc_pid_stat(5).
ARGUMENTS_START = 48 - 3
ARGUMENTS_END = 49 - 3


class Request(msgspec.Struct, array_like=True):
    """Run `cogmap` with `arguments` in a new process, named `number`.

    Two file descriptors travel with it: what it reads from, and what it prints to.
    """

    number: int
    arguments: list[str]


class Report(msgspec.Struct, array_like=True):
    """Process `number` runs as `pid`; once it has ended, its exit code, or the number of the signal
    that ended it below 0.
    """

    number: int
    pid: int
    code: int | None = None


request_decoder = msgspec.msgpack.Decoder(Request)
report_decoder = msgspec.msgpack.Decoder(Report)


class Server:
    """Forks a process for each request on `channel`."""

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        self._running: dict[int, Report] = {}
        self._steps = preparation()
        self._is_prepared = False

    def serve(self) -> list[str] | None:
        """Fork as requested until `channel` ends. Returns None then and, in each forked process,
        the arguments of `cogmap` that were requested.

        While no request waits, it imports what later ones may need.
        """
        gc.disable()
        next(self._steps)
        channel = self._channel.fileno()
        while True:
            waits_s = None if self._is_prepared else 0.0
            ready, _, _ = select.select([channel, *self._running], [], [], waits_s)
            if not ready:
                self._is_prepared = next(self._steps, self) is self

            for ended in self._running.keys() & set(ready):
                self._reap(ended)
            if channel not in ready:
                continue

            payload, descriptors, _, _ = socket.recv_fds(self._channel, MAX_BYTES, 2)
            if not payload:
                return None
            request = request_decoder.decode(payload)
            if self._fork(request.number, request.arguments, descriptors):
                return request.arguments

    def _fork(self, number: int, arguments: list[str], descriptors: list[int]) -> bool:
        """Fork a process. Returns whether this is the new one."""
        with suppress(Exception):
            deque(needed(arguments), maxlen=0)

        # What is there by now is no garbage: the new process need not search it.
        gc.freeze()
        pid = os.fork()
        if pid == 0:
            self._become(arguments, descriptors)
            return True

        for descriptor in descriptors:
            os.close(descriptor)
        report = Report(number, pid)
        self._running[os.pidfd_open(pid)] = report
        self._send(report)
        return False

    def _become(self, arguments: list[str], descriptors: list[int]) -> None:
        """Let the new process be as if it had been started by itself."""
        source, sink = descriptors
        os.setsid()
        os.dup2(source, 0)
        os.dup2(sink, 1)
        os.dup2(sink, 2)

        self._channel.close()
        for descriptor in (source, sink, *self._running):
            os.close(descriptor)

        show_command_line(cogmap_command(*arguments))
        gc.enable()

    def _reap(self, descriptor: int) -> None:
        """Report the end of a process."""
        report = self._running.pop(descriptor)
        os.close(descriptor)
        _, status = os.waitpid(report.pid, 0)
        report.code = os.waitstatus_to_exitcode(status)
        self._send(report)

    def _send(self, report: Report) -> None:
        with suppress(OSError):  # nobody is left to receive it, as is noticed when reading next
            self._channel.send(msgspec.msgpack.encode(report))


def needed(arguments: Sequence[str]) -> Iterator[None]:
    """Import what `cogmap` with these `arguments` consists of, in steps. Raises what an import
    raises.
    """
    yield from _imports(COMMON)
    match arguments:
        case ["log", *_]:
            yield from _imports(RECORDING)
        case ["module", name, *_]:
            yield from registry.prepare(name)


def _imports(names: Sequence[str]) -> Iterator[None]:
    for name in names:
        importlib.import_module(name)
        yield


def preparation() -> Iterator[None]:
    """Import all that may be forked, in steps, last what takes longest. If that fails, the process
    that needs it names the reason.
    """
    # It tries the EGL plugin in another process, meanwhile.
    with suppress(Exception):
        yield next(registry.prepare("sim"))

    with suppress(Exception):
        yield from needed(["log"])

    for name in sorted(registry.MODULES, key=registry.runs_codelets):
        with suppress(Exception):
            yield from registry.prepare(name)


def show_command_line(command: Sequence[str]) -> None:
    """Let /proc, and so ps, show `command`, cut where it is longer than what this process was
    started with. The rest of that is blank. Linux only.
    """
    _, _, status = Path("/proc/self/stat").read_text().rpartition(")")
    fields = status.split()
    start = int(fields[ARGUMENTS_START])
    room = int(fields[ARGUMENTS_END]) - start

    words = b"\0".join(os.fsencode(word) for word in command)
    shown = (words + b"\0")[: room - 1].ljust(room - 1) + b"\0"
    ctypes.memmove(start, shown, room)


def main() -> None:
    """Serve on the socket whose file descriptor is the first argument."""
    with socket.socket(fileno=int(sys.argv[1])) as channel:
        arguments = Server(channel).serve()
    if arguments is None:
        return

    sys.argv = ["cogmap", *arguments]
    from cogmap.cli.main import main as cogmap

    cogmap()


if __name__ == "__main__":
    main()
