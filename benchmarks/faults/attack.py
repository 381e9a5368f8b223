"""One drive whose processes are killed, one after another."""

from __future__ import annotations

import json
import math
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import psutil

from benchmarks.faults.parts import FORK_SERVER, ROUTER, all_at, is_idle, kill, pids_of
from benchmarks.faults.witness import Seen, Witness
from cogmap.bus.session import free_endpoint, listens
from cogmap.cli.launch.supervisor import MAX_QUICK_DEATHS, STEADY_S
from cogmap.cli.launch.watchdog import STALLED_S
from cogmap.cli.run.child import DriveProcess
from cogmap.errors import CogmapError

AGENT = "faults"
BEGIN_S = 180.0
SETTLED_COMMANDS = 5
"""So many commands after the killed one is back, all is as before."""

MAX_PAUSE_S = 1.0
QUIET_S = 1.0
QUIET_LIMIT_S = 30.0
ORPHANS_S = 5.0
LOOK_S = 0.05
LOOK_AT_ALL_S = 0.25
IDLE_LOOKS = 3
"""So often in a row a fork server must be idle that it is not only reading a file."""

TOWN_M = 120
EXPLORE_S = 100_000
FOLDER = "drive"
JOURNAL = "workspace.journal"


@dataclass(frozen=True)
class Kill:
    """A kill of `part` at `at_ns` of wall time, which was back at `returned_ns`; the longest wait
    for a command after it was `back_s`, infinite where none came.
    """

    part: str
    at_ns: int
    returned_ns: int
    back_s: float


@dataclass
class Attacked:
    """What is left of a drive in `folder`: `kills`, what a witness has `seen`, the digests of the
    graph as the workspace had it in the end, empty if it did not answer, and as followed, and the
    processes that outlived it.
    """

    folder: Path
    is_lockstep: bool
    seen: Seen
    kills: list[Kill] = field(default_factory=list)
    graph_digest: str = ""
    graph_version: int = 0
    followed_digest: str = ""
    orphans: int = 0

    @property
    def summary(self) -> dict[str, Any]:
        """Return what the drive says of itself; nothing where it left no summary."""
        path = self.folder / "summary.json"
        if not path.is_file():
            return {}
        summary: dict[str, Any] = json.loads(path.read_text())
        return summary

    @property
    def logs(self) -> list[Path]:
        """Return its logs, the first one first."""
        return sorted(self.folder.glob("*.mcap"), key=lambda path: (len(path.name), path.name))


def attack(
    folder: Path,
    parts: Iterator[str],
    seed: int,
    is_lockstep: bool,
    goes_on: Callable[[Attacked], bool],
) -> Attacked:
    """Drive in `folder`, and kill one of `parts` after another while `goes_on`, which is asked
    after each. A drive that has stalled or ended is attacked no more.

    Raises CogmapError if it does not begin.
    """
    endpoint = free_endpoint()
    folder.mkdir(parents=True)
    with (folder / "output.txt").open("wb") as output:
        words = _words(folder / FOLDER, endpoint, seed, is_lockstep)
        with DriveProcess(words, output) as process, _witness(endpoint, process) as witness:
            attacked = Attacked(folder / FOLDER, is_lockstep, witness.seen)
            attacker = _Attacker(witness, process, endpoint, Random(seed))
            while goes_on(attacked):
                found = attacker.kill(next(parts))
                if found is None:
                    break
                attacked.kills.append(found)
                if math.isinf(found.back_s):
                    break

            _look_at_graphs(attacked, witness)
            journal = attacked.folder / "state" / JOURNAL
            if journal.is_file():
                shutil.copyfile(journal, folder / JOURNAL)
            servers = pids_of(endpoint, FORK_SERVER)

    attacked.orphans = _left_of(endpoint, servers)
    return attacked


def _words(folder: Path, endpoint: str, seed: int, is_lockstep: bool) -> list[str]:
    words = ["--out", str(folder), "--connect", endpoint, "--agent", AGENT, "--seed", str(seed)]
    words += ["--town", "blocks", "--explore", str(EXPLORE_S), "--codelets", "2"]
    words += ["--set", f"sim.town_size_m={TOWN_M}"]
    words += ["--lockstep", "--set", "sim.sensing=percepts"] if is_lockstep else []
    return words


@contextmanager
def _witness(endpoint: str, process: DriveProcess) -> Iterator[Witness]:
    """Yield a witness of a drive, once that has begun. Raises CogmapError if it does not begin."""
    port = int(endpoint.rpartition(":")[2])
    _await(lambda: listens(port), process)
    witness = Witness(endpoint, AGENT)

    def has_begun() -> bool:
        witness.pump(LOOK_S)
        return len(witness.seen.commands_s) >= SETTLED_COMMANDS

    try:
        _await(has_begun, process)
        yield witness
    finally:
        witness.close()


def _await(condition: Callable[[], bool], process: DriveProcess) -> None:
    limit_s = time.monotonic() + BEGIN_S
    while not condition():
        if process.poll() is not None or time.monotonic() > limit_s:
            raise CogmapError("a drive did not begin: end other programs, and try again")
        time.sleep(LOOK_S)


class _Attacker:
    """Kills parts of the drive that is `process`, at `endpoint`."""

    def __init__(
        self, witness: Witness, process: DriveProcess, endpoint: str, random: Random
    ) -> None:
        self._witness = witness
        self._process = process
        self._endpoint = endpoint
        self._random = random
        self._deaths_s: dict[str, list[float]] = {}
        self._idle_looks = 0
        self._look_at_s = 0.0

    def kill(self, part: str) -> Kill | None:
        """Kill a part at some time, and wait until the drive goes on as before; None where it has
        ended.
        """
        deaths_s = self._deaths_s.setdefault(part, [])
        pause_s = max(self._random.uniform(0.0, MAX_PAUSE_S), _rest_s(deaths_s))
        until_s = time.monotonic() + pause_s
        while (left_s := until_s - time.monotonic()) > 0:
            self._witness.pump(left_s)

        pids = pids_of(self._endpoint, part)
        if not pids or self._process.poll() is not None:
            return None

        self._witness.pump(0.0)
        arrivals = self._witness.present[part]
        before = len(self._commands_s)
        at_ns = time.time_ns()
        at_s = time.monotonic()
        deaths_s.append(at_s)
        for pid in pids:
            kill(pid)

        returned_ns = 0
        settled = 0
        times_s = [at_s]
        while time.monotonic() - times_s[-1] < STALLED_S and self._process.poll() is None:
            self._witness.pump(LOOK_S)
            times_s = [at_s, *self._commands_s[before:]]
            if not returned_ns:
                if self._is_back(part, pids, arrivals):
                    returned_ns = time.time_ns()
                    settled = len(times_s) + SETTLED_COMMANDS
            elif len(times_s) >= settled:
                waits_s = [later - earlier for earlier, later in pairwise(times_s)]
                return Kill(part, at_ns, returned_ns, max(waits_s))

        return Kill(part, at_ns, returned_ns or time.time_ns(), math.inf)

    @property
    def _commands_s(self) -> list[float]:
        return self._witness.seen.commands_s

    def _is_back(self, part: str, killed: list[int], arrivals: int) -> bool:
        """Decide whether a part is there again: by its presence if it has one; a fork server once
        it has prepared what it may fork.
        """
        if part not in {ROUTER, FORK_SERVER}:
            return self._witness.present[part] > arrivals

        # To look through all processes of a machine takes a while.
        now_s = time.monotonic()
        if now_s < self._look_at_s:
            return False

        others = set(pids_of(self._endpoint, part)) - set(killed)
        self._look_at_s = now_s + LOOK_AT_ALL_S
        if part == ROUTER:
            return bool(others)
        self._idle_looks = self._idle_looks + 1 if any(map(is_idle, others)) else 0
        return self._idle_looks >= IDLE_LOOKS


def _rest_s(deaths_s: list[float]) -> float:
    """Return how long to spare a part, as the supervisor gives up what dies too often."""
    allowed = MAX_QUICK_DEATHS - 2
    if len(deaths_s) < allowed:
        return 0.0
    return max(0.0, deaths_s[-1] + STEADY_S + MAX_PAUSE_S - time.monotonic())


def _look_at_graphs(attacked: Attacked, witness: Witness) -> None:
    """Let time stand, and compare the graphs once all is done."""
    witness.pause()
    witness.pump_until_quiet(QUIET_S, QUIET_LIMIT_S)
    graph = witness.snapshot()
    if graph is not None:
        attacked.graph_digest = graph.digest()
        attacked.graph_version = graph.version
    witness.pump(0.0)
    attacked.followed_digest = witness.digest


def _left_of(endpoint: str, servers: list[int]) -> int:
    """Count the processes that do not end with the drive at `endpoint`, and end them."""

    def left() -> list[int]:
        return [*all_at(endpoint), *filter(psutil.pid_exists, servers)]

    limit_s = time.monotonic() + ORPHANS_S
    while (pids := left()) and time.monotonic() < limit_s:
        time.sleep(LOOK_S)
    for pid in pids:
        kill(pid)
    return len(pids)
