"""A drive as a process of its own: `cogmap run`, started by another program."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Sequence
from types import TracebackType
from typing import IO

from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.errors import CogmapError, UsageError

GRACE_S = 20.0
"""To end its processes in order, and to write the summary and the map."""
USAGE_EXIT = 2


class DriveProcess:
    """`cogmap run` with the options `words`; what it shows goes to `output`, a file or PIPE.

    Use it in a `with` statement, at whose end the drive is asked to end if it still goes on. It
    ends too when this process does, whatever the cause.
    """

    def __init__(self, words: Sequence[str], output: int | IO[bytes]) -> None:
        # A session of its own: a Ctrl-C is answered by this process, which then ends it.
        self._process = subprocess.Popen(
            cogmap_command("run", "--tied", "--json", *words),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=output,
            env=environment(),
            start_new_session=True,
        )

    @property
    def shown(self) -> IO[bytes]:
        """Return what it shows, where `output` is PIPE."""
        assert self._process.stderr is not None
        return self._process.stderr

    @property
    def pid(self) -> int:
        """Return its process id."""
        return self._process.pid

    def poll(self) -> int | None:
        """Return its exit code; None while it goes on."""
        return self._process.poll()

    def wait(self) -> int:
        """Wait for its end, and return its exit code."""
        return self._process.wait()

    def ask_to_end(self) -> None:
        """Ask it to end in order, as a Ctrl-C does."""
        if self.poll() is None:
            self._process.send_signal(signal.SIGINT)

    def __enter__(self) -> DriveProcess:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.ask_to_end()
        try:
            self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        finally:
            for pipe in (self._process.stdin, self._process.stderr):
                if pipe is not None:
                    pipe.close()


def failure(code: int, shown: str) -> CogmapError:
    """Make the error of a drive that ended with `code`, and left no summary, of what it showed:
    the last line says why.
    """
    lines = [line for line in shown.splitlines() if line.strip()]
    last = lines[-1] if lines else f"`cogmap run` ended with code {code}, and without a word"
    sentence = last.removeprefix("cogmap: ").removeprefix("Error: ")
    return UsageError(sentence) if code == USAGE_EXIT else CogmapError(sentence)
