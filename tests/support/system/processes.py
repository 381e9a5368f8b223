"""A system of real processes over real Zenoh."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import psutil

from cogmap.bus.session import free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus

TIMEOUT_S = 40.0
POLL_S = 0.02
POOLS = ("sem.mp-", "sem.loky-", "joblib_")
AGENT = "fault"


def wait_until(condition: Callable[[], bool], what: str, timeout_s: float = TIMEOUT_S) -> None:
    """Poll until `condition` holds."""
    deadline_s = time.monotonic() + timeout_s
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline_s, f"it never happened: {what}"
        pause.wait(POLL_S)


def shared_memory() -> set[Path]:
    """Files in shared memory, but for those of pools of processes, which no module uses."""
    paths = Path("/dev/shm").iterdir()
    return {path for path in paths if not path.name.startswith(POOLS)}


class Process:
    """A `cogmap` process, which ends when this one does."""

    def __init__(self, name: str, log: Path, *arguments: str) -> None:
        self.name = name
        self._log = log
        with log.open("ab") as output:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "cogmap.cli.main", *arguments],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=output,
            )
        self.pid = self._process.pid

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    @property
    def exit_code(self) -> int | None:
        """What it ended with; None while it is alive."""
        return self._process.poll()

    @property
    def memory_mb(self) -> float:
        """Its resident memory."""
        memory = psutil.Process(self.pid).memory_info()
        return memory.rss / 1e6

    def lines(self) -> list[str]:
        """The lines of its log, also those of processes of the same name before it."""
        return self._log.read_text().splitlines()

    def send(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def end(self, how: signal.Signals) -> int:
        """Send `how`, wait, and return the exit code."""
        self.send(how)
        self.send(signal.SIGCONT)
        with self._process as process:
            return process.wait(TIMEOUT_S)


class System:
    """Processes that meet at one endpoint, with their logs and state in `folder`."""

    def __init__(self, folder: Path) -> None:
        self.endpoint = free_endpoint()
        self.folder = folder
        self.processes: dict[str, Process] = {}

    def bus(self) -> ZenohBus:
        """A connection of this test's own."""
        return ZenohBus(self.endpoint, AGENT)

    def router(self) -> Process:
        """Start the router, or start it again."""
        earlier = self.start("router", "router")
        return self._await("router", "router listens", earlier)

    def modules(self, *instances: str, settings: tuple[str, ...] = ()) -> list[Process]:
        """Start modules by their instances, such as `codelets-1`, and wait until all are ready."""
        options = ["--agent", AGENT, "--state", str(self.folder / "state")]
        for setting in settings:
            options += ["--set", setting]

        earlier = {}
        for instance in instances:
            module, _, _ = instance.partition("-")
            earlier[instance] = self.start(
                instance, "module", module, "--instance", instance, *options
            )
        return [self._await(name, f"{name} is ready", earlier[name]) for name in instances]

    def start(self, name: str, *arguments: str) -> int:
        """Start `cogmap` with these arguments. Returns how many lines its log has already."""
        log = self.folder / f"{name}.log"
        log.touch()
        earlier = log.read_text().splitlines()
        options = ("--tied", "--connect", self.endpoint)
        self.processes[name] = Process(name, log, *arguments, *options)
        return len(earlier)

    def close(self) -> None:
        """End everything, modules first."""
        for name in sorted(self.processes, key=lambda name: name == "router"):
            process = self.processes[name]
            if process.is_alive:
                process.end(signal.SIGTERM)

    def _await(self, name: str, sentence: str, earlier: int) -> Process:
        """Wait until a process logs `sentence`, after so many lines."""
        process = self.processes[name]

        def is_ready() -> bool:
            lines = process.lines()
            assert process.is_alive, lines
            return any(sentence in line for line in lines[earlier:])

        wait_until(is_ready, f"{name} logs {sentence!r}")
        return process
