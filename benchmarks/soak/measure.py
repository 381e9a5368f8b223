"""What grows while the agent drives for hours: memory, descriptors, cycles, log and journals."""

from __future__ import annotations

import subprocess
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import click
import numpy as np

from benchmarks.benchmark import Setting
from benchmarks.report import Metrics
from benchmarks.soak import trends
from benchmarks.soak.processes import UNKNOWN, sample
from benchmarks.soak.rounds import Cycles, Rounds
from benchmarks.soak.trends import Sample, Sizes, Span
from benchmarks.threshold import at_least, at_most
from cogmap.bus.session import free_port, listens
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.cli.launch.plan import MEMORY_NAME, STATE_NAME
from cogmap.cli.progress import bar
from cogmap.cli.run.child import DriveProcess
from cogmap.cli.run.script import summary_after
from cogmap.errors import CogmapError
from cogmap.parallel import Progress
from cogmap.runtime.client import Client
from cogmap.runtime.state.journal import COMPACT_BYTES
from cogmap.schemas import topics

AGENT = "soak"
SEED = 1
LOG_PART_MB = 16
LOG_PARTS = 4
SLACK_BYTES = 4e6
"""What the recorder may write before it looks how long a file is, a quarter of a second's."""
JOURNAL_SLACK_BYTES = 2**20
SAMPLES = 2_000
MIN_PERIOD_S = 1.0
START_S = 60.0
POLL_S = 0.1

THRESHOLDS = {
    "memory_slope_mb_per_h_max": at_most(1.0),
    "descriptors_growth": at_most(0.0),
    "cycle_p50_end_over_begin": at_most(1.1),
    "log_bounded": at_least(1.0),
    "journal_bounded": at_least(1.0),
}
OPTIONS = (
    click.Option(
        ["--hours"],
        type=click.FloatRange(0.005, 1_000),
        default=2.0,
        show_default=True,
        help="How long to drive; the first quarter warms up.",
    ),
    click.Option(
        ["--percepts/--cameras", "is_of_percepts"],
        default=True,
        show_default=True,
        help="Percepts in lockstep, or camera images in real time.",
    ),
    click.Option(
        ["--seed"],
        type=click.IntRange(0, 2**32),
        default=SEED,
        show_default=True,
        help="Of the town and of all noise.",
    ),
)


def measure(
    setting: Setting, *, hours: float = 2.0, is_of_percepts: bool = True, seed: int = SEED
) -> Metrics:
    """Drive for hours, and measure what grows.

    Every module is a process of its own, the robot drives lap after lap of the loop town, and a
    recorder keeps the newest parts of a split log. Each process's memory and descriptors are
    sampled, and cycles timed, on loopback at a free port. Nothing in the first quarter counts.

    \b
    python -m benchmarks soak --hours 2 --json soak.json
    python -m benchmarks soak --hours 2 --cameras --json cameras.json
    """
    run_s = 3600.0 * hours
    with bar("driving") as progress:
        soak = Soak(setting, run_s, is_of_percepts, seed)
        soak.run(progress)
    return soak.metrics()


class Soak:
    """One drive of `run_s`, with its files in the setting's folder, and what was sampled of it."""

    def __init__(self, setting: Setting, run_s: float, is_of_percepts: bool, seed: int) -> None:
        self._announce = setting.announce
        self._run = setting.folder / "run"
        self._logs = setting.folder / "log"
        self._ended_early = False
        self._run_s = run_s
        self._period_s = max(MIN_PERIOD_S, run_s / SAMPLES)
        self._port = free_port()
        self._endpoint = f"tcp/127.0.0.1:{self._port}"
        self._words = _words(self._run, self._endpoint, run_s, is_of_percepts, seed)
        self._samples: dict[tuple[str, int], list[Sample]] = defaultdict(list)
        self._sizes: list[Sizes] = []
        self._rounds = Rounds()
        self._cycles = Cycles()
        self._began_s = 0.0

    def run(self, progress: Progress) -> None:
        """Drive for the time, and end every process. Raises CogmapError if the drive does not
        begin.
        """
        self._logs.mkdir()
        with ExitStack() as stack:
            shown = stack.enter_context(self._run.with_name("run.txt").open("w+b"))
            drive = stack.enter_context(DriveProcess(self._words, shown))

            def check() -> None:
                """Raise CogmapError if the drive has ended."""
                code = drive.poll()
                if code is None:
                    return
                shown.seek(0)
                ended = summary_after(self._run, code, shown.read().decode(errors="replace"))
                raise CogmapError(f"{ended.ended_by}: {ended.reason}")

            _await(lambda: listens(self._port), "router", check)
            recorder = stack.enter_context(_recorder(self._logs / "log.mcap", self._endpoint))
            bus = ZenohBus(self._endpoint, AGENT)
            stack.callback(bus.close)
            bus.subscribe(topics.MOTOR_COMMAND, self._cycles.on_command, _ignore_gap)
            stack.enter_context(Client(self._rounds.module, self._endpoint, AGENT))

            def check_both() -> None:
                """Raise CogmapError if the drive or its recorder has ended."""
                check()
                if recorder.poll() is not None:
                    raise CogmapError("the recorder has ended: its last words are above")

            _await(lambda: bool(self._cycles.at_s), "command", check_both)
            self._sample((drive.pid, recorder.pid), check_both, progress)

    def _sample(self, pids: tuple[int, int], check: Callable[[], None], progress: Progress) -> None:
        self._began_s = time.monotonic()
        at_s = 0.0
        due_s = 0.0
        while at_s < self._run_s:
            try:
                check()
            except CogmapError as error:
                self._announce(f"the drive ended early, what it was is measured: {error}")
                self._ended_early = True
                # After its last command a drive draws its map, which takes memory.
                self._run_s = self._cycles.at_s[-1] - self._began_s
                return

            at_s = time.monotonic() - self._began_s
            if at_s >= due_s:
                due_s += self._period_s
                for key, held in sample(pids, at_s):
                    self._samples[key].append(held)
                self._sizes.append(_sizes(self._run, self._logs, at_s))
                progress(min(1.0, at_s / self._run_s))
            time.sleep(POLL_S)

    def metrics(self) -> Metrics:
        """Return what grew, of all together and of each process.

        One that was started again is judged by its longest life; `restarts` counts the others.
        """
        span = Span.after_warm_up(self._run_s)
        lives = self._longest_lives()

        slopes = {name: trends.slope_mb_per_h(life, span) for name, life in lives.items()}
        growths = {name: trends.descriptors_growth(life, span) for name, life in lives.items()}
        begin_ms, end_ms = trends.cycle_p50_ms(
            np.array(self._cycles.at_s) - self._began_s, np.array(self._cycles.cycle_ms), span
        )

        limit_bytes = (LOG_PARTS + 1) * (1e6 * LOG_PART_MB + SLACK_BYTES)
        is_log_bounded = trends.is_log_bounded(self._sizes, limit_bytes)
        journal_limit_bytes = COMPACT_BYTES + JOURNAL_SLACK_BYTES
        is_journal_bounded = trends.is_journal_bounded(self._sizes, journal_limit_bytes)

        metrics = {
            "memory_slope_mb_per_h_max": float(np.max([*slopes.values()])),
            "descriptors_growth": float(np.max([*growths.values()])),
            "cycle_p50_end_over_begin": end_ms / begin_ms,
            "log_bounded": float(is_log_bounded),
            "journal_bounded": float(is_journal_bounded),
            "cycle_p50_ms_begin": begin_ms,
            "cycle_p50_ms_end": end_ms,
            "cycles": float(len(self._cycles.at_s)),
            "rounds": float(self._rounds.number),
            "hours": self._run_s / 3600.0,
            "ended_early": float(self._ended_early),
            "restarts": float(len(self._samples) - len(lives)),
            "samples": float(len(self._sizes)),
            "log_mb_max": max(each.log_bytes for each in self._sizes) / 1e6,
            "journal_mb_end": sum(self._sizes[-1].journal_bytes.values()) / 1e6,
            "journal_compactions": float(trends.compactions(self._sizes)),
            "long_term_memory_mb_end": self._sizes[-1].memory_bytes / 1e6,
        }
        for name, life in sorted(lives.items()):
            metrics[f"memory_slope_mb_per_h_{name}"] = slopes[name]
            metrics[f"memory_mb_end_{name}"] = life[-1].memory_bytes / 1e6
        return metrics

    def _longest_lives(self) -> dict[str, list[Sample]]:
        """Return the samples of each process by name, of the longest-lived one of that name."""
        found: dict[str, list[Sample]] = {}
        for (name, _), life in self._samples.items():
            if name != UNKNOWN and len(life) > len(found.get(name, ())):
                found[name] = life

        return found


def _await(has_come: Callable[[], bool], what: str, check: Callable[[], None]) -> None:
    """Wait for the router or the first command, and `check` meanwhile. Raises CogmapError."""
    deadline_s = time.monotonic() + START_S
    while not has_come():
        check()
        if time.monotonic() > deadline_s:
            raise CogmapError(f"no {what} came within {START_S:g} s: end other programs first")
        time.sleep(POLL_S)


def _words(folder: Path, endpoint: str, run_s: float, is_of_percepts: bool, seed: int) -> list[str]:
    """Return the options of `cogmap run` for a drive that lasts longer than `run_s`."""
    settings = {
        "sim.ends_at_goal": "false",
        "sim.duration_s": "1e6",
        "sim.sensing": "percepts" if is_of_percepts else "cameras",
    }
    mode = "--lockstep" if is_of_percepts else "--real-time"
    words = ["--out", str(folder), "--connect", endpoint, "--agent", AGENT, "--seed", str(seed)]
    words += ["--laps", "1", "--no-record", mode, "--time-limit", str(run_s + 10 * START_S)]
    for key, value in settings.items():
        words += ["--set", f"{key}={value}"]

    return words


@contextmanager
def _recorder(path: Path, endpoint: str) -> Iterator[subprocess.Popen[bytes]]:
    """Record all messages into a split log of which the newest LOG_PARTS are kept."""
    split = ["--split-mb", str(LOG_PART_MB), "--keep", str(LOG_PARTS)]
    options = ["--tied", "--connect", endpoint, "--agent", AGENT, "-o", str(path)]
    with subprocess.Popen(
        cogmap_command("log", "record", *options, *split),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        env=environment(),
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


def _sizes(run: Path, logs: Path, at_s: float) -> Sizes:
    """Return how long the files are now."""
    journals = {path.name: path.stat().st_size for path in (run / STATE_NAME).glob("*.journal")}
    log_bytes = sum(path.stat().st_size for path in logs.iterdir())
    memory_path = run / MEMORY_NAME
    memory_bytes = memory_path.stat().st_size if memory_path.exists() else 0
    return Sizes(at_s, log_bytes, journals, memory_bytes)


def _ignore_gap(topic: str, number: int) -> None:
    """Do nothing: a command that was lost is one cycle less to time."""
