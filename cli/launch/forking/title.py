"""The command line that other processes see of this one."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from pathlib import Path

# Counted from the third, which is the first after the name (proc_pid_stat(5)).
_ARGUMENTS_START = 48 - 3
_ARGUMENTS_END = 49 - 3


def show_command_line(command: Sequence[str]) -> None:
    """Let /proc, and so ps, show `command`, cut where it is longer than what this process was
    started with. The rest of that is blank. Linux only.
    """
    _, _, status = Path("/proc/self/stat").read_text().rpartition(")")
    fields = status.split()
    start = int(fields[_ARGUMENTS_START])
    room = int(fields[_ARGUMENTS_END]) - start

    words = b"\0".join(os.fsencode(word) for word in command)
    shown = (words + b"\0")[: room - 1].ljust(room - 1) + b"\0"
    ctypes.memmove(start, shown, room)
