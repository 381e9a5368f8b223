"""The processes of a drive: which there are, and which process each one is."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import psutil

from cogmap.services import registry

FORK_SERVER = "fork_server"
ROUTER = "router"
RECORDER = "recorder"
WORKERS = ("codelets-1", "codelets-2")
MODULES = tuple(name for name in registry.taking_part() if name != "codelets")
PARTS = (FORK_SERVER, ROUTER, RECORDER, *WORKERS, *MODULES)

_RUN = ("cogmap.cli.main", "run")
_SERVER = "cogmap.cli.launch.forking.server"


def key_of(part: str) -> str:
    """Return how the metrics of a part are named: all workers are one."""
    return "codelets" if part in WORKERS else part


def pids_of(endpoint: str, part: str) -> list[int]:
    """Return the processes that are `part` in the drive at `endpoint`; none where it is away."""
    found = []
    for process, words in _at(endpoint):
        if part == FORK_SERVER:
            found += _fork_servers(process) if _is_run(words) else []
        elif _is(part, words):
            found.append(process.pid)
    return found


def all_at(endpoint: str) -> list[int]:
    """Return every process with `endpoint` in its command line, and the fork servers."""
    pids = []
    for process, words in _at(endpoint):
        pids.append(process.pid)
        if _is_run(words):
            pids += _fork_servers(process)
    return pids


def is_idle(pid: int) -> bool:
    """Decide whether a process waits, as a fork server does that has imported all."""
    try:
        status: str = psutil.Process(pid).status()
    except psutil.NoSuchProcess:
        return False
    return status == psutil.STATUS_SLEEPING


def kill(pid: int) -> None:
    """Send SIGKILL."""
    os.kill(pid, signal.SIGKILL)


def _at(endpoint: str) -> Iterator[tuple[psutil.Process, list[str]]]:
    own = os.getpid()
    for process in psutil.process_iter(["cmdline", "status"]):
        words = [word for word in process.info["cmdline"] or [] if word.strip()]
        is_there = process.info["status"] != psutil.STATUS_ZOMBIE and process.pid != own
        if is_there and endpoint in words:
            yield process, words


def _is(part: str, words: list[str]) -> bool:
    if part == ROUTER:
        return ROUTER in words and "--instance" not in words
    if part == RECORDER:
        return "record" in words
    return "--instance" in words and words[words.index("--instance") + 1] == part


def _is_run(words: list[str]) -> bool:
    return tuple(words[words.index(_RUN[0]) :][:2]) == _RUN if _RUN[0] in words else False


def _fork_servers(run: psutil.Process) -> list[int]:
    try:
        return [each.pid for each in run.children() if _SERVER in each.cmdline()]
    except psutil.NoSuchProcess:
        return []
