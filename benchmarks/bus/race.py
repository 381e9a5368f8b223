"""One process that publishes to several that receive, all started together and timed to the end."""

from __future__ import annotations

import multiprocessing
import multiprocessing.synchronize
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.sharedctypes import Synchronized

from cogmap.errors import CogmapError

REPLICAS = 3
TIMEOUT_S = 60.0
_spawn = multiprocessing.get_context("spawn")


@dataclass
class Race:
    """The state that the processes of one run share: `number` messages travel through `endpoint`.

    Each process releases `ready`; `go` starts the publisher; each receiver releases `done` when it
    has the last message; `end` lets all exit. `cpu_s` sums what they spent between ready and end.
    """

    endpoint: str
    number: int
    ready: multiprocessing.synchronize.Semaphore
    go: multiprocessing.synchronize.Event
    done: multiprocessing.synchronize.Semaphore
    end: multiprocessing.synchronize.Event
    cpu_s: Synchronized[float]

    @classmethod
    def at(cls, endpoint: str, number: int) -> Race:
        """Make a race of `number` messages through the router at `endpoint`."""
        return cls(
            endpoint=endpoint,
            number=number,
            ready=_spawn.Semaphore(0),
            go=_spawn.Event(),
            done=_spawn.Semaphore(0),
            end=_spawn.Event(),
            cpu_s=_spawn.Value("d", 0.0),
        )

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Release `ready`, and add the CPU time of the block to that of all processes."""
        began_s = time.process_time()
        self.ready.release()
        yield

        with self.cpu_s.get_lock():
            self.cpu_s.value += time.process_time() - began_s


@dataclass(frozen=True)
class Pace:
    """Messages per second until the last process has the last one; CPU time of all for each."""

    rate_hz: float
    cpu_us: float


def pace(
    endpoint: str, number: int, publish: Callable[[Race], None], receive: Callable[[Race], None]
) -> Pace:
    """Let a process `publish` `number` messages to REPLICAS that `receive` them.

    The router at `endpoint` runs in the calling process, whose CPU time counts. Raises
    CogmapError if a process does not answer within TIMEOUT_S.
    """
    race = Race.at(endpoint, number)
    processes = []
    for work in [receive] * REPLICAS + [publish]:
        process = _spawn.Process(target=work, args=(race,), daemon=True)
        process.start()
        processes.append(process)

    for _ in processes:
        _wait(race.ready)

    began_s = time.monotonic()
    router_began_s = time.process_time()
    race.go.set()
    for _ in range(REPLICAS):
        _wait(race.done)

    router_s = time.process_time() - router_began_s
    took_s = time.monotonic() - began_s
    race.end.set()
    for process in processes:
        process.join()

    cpu_s = race.cpu_s.value + router_s
    return Pace(rate_hz=number / took_s, cpu_us=1e6 * cpu_s / number)


def _wait(semaphore: multiprocessing.synchronize.Semaphore) -> None:
    if not semaphore.acquire(timeout=TIMEOUT_S):
        raise CogmapError(
            f"a process of the benchmark did not answer within {TIMEOUT_S:g} s: see what it printed"
        )
