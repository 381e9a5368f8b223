"""What it costs a running agent, and loses, if one subscriber is stopped for a while."""

from __future__ import annotations

import math
import signal
import time
from collections import Counter, defaultdict
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import click

from benchmarks.benchmark import Setting
from benchmarks.report import Metrics
from benchmarks.stall.system import AGENT, Agent, Recorder, wait, wait_until
from benchmarks.stall.witness import Stream, Witness
from benchmarks.threshold import at_most
from cogmap.cli.options import FiniteRange
from cogmap.cli.progress import bar
from cogmap.recording.completeness import NEVER_DROP, sequence_of
from cogmap.recording.storage.reader import LogReader

THRESHOLDS = {
    "gap_s": at_most(0.5),
    "lost": at_most(0),
    "unsaid": at_most(0),
    "growth_mb": at_most(64),
}
STOPS_S = (5.0, 60.0, 300.0)
TIME_LIMIT_S = 1200.0
# How long before a stop is looked at for comparison, and how often whether all has come after it.
BEFORE_S = 5.0
LOOK_S = 2.0
POLL_S = 0.1
FIRST_DELTAS = 50
OPTIONS = (
    click.Option(
        ["--stops", "stops_s"],
        type=FiniteRange(0, 3600, min_open=True),
        multiple=True,
        default=STOPS_S,
        show_default=True,
        metavar="SECONDS",
        help="How long to stop it; repeatable.",
    ),
    click.Option(
        ["--seed"], type=int, default=1, show_default=True, help="Seed of the town and the noise."
    ),
    click.Option(
        ["--lockstep/--real-time", "is_lockstep"],
        default=True,
        show_default=True,
        help="Drive as fast as it can, in lockstep, or in real time.",
    ),
    click.Option(
        ["--time-limit-s"],
        type=FiniteRange(1, 1e5),
        default=TIME_LIMIT_S,
        show_default=True,
        help="Of all together; it fails if it takes longer.",
    ),
)


@dataclass(frozen=True)
class Stop:
    """What one stop did. `stopped_gap_s` is the longest time without a delta during it, and
    `after_gap_s` afterwards, `before_s` over a shorter while before it; `again` counts what the
    recorder fetched from the sources.
    """

    stopped_gap_s: float
    after_gap_s: float
    before_s: float
    missed: int
    again: int
    lost: int
    unsaid: int
    growth_mb: float
    recovered_s: float

    @property
    def gap_s(self) -> float:
        """Return the longest time without a delta during the stop and afterwards."""
        return max(self.stopped_gap_s, self.after_gap_s)


def measure(
    setting: Setting,
    *,
    stops_s: tuple[float, ...] = STOPS_S,
    seed: int = 1,
    is_lockstep: bool = True,
    time_limit_s: float = TIME_LIMIT_S,
) -> Metrics:
    """Stop a recorder of all that a running agent publishes, and let it continue.

    `gap_s` is the longest time that another subscriber waited for a delta meanwhile, and until the
    recorder had everything; `lost` are the never-drop messages that its log lacks in the end,
    `unsaid` those of them that its summary does not count, and `growth_mb` is how much the router's
    memory grew. The agent explores a town at percept level. Takes about eight minutes.

    In lockstep more than twice as many messages are to be fetched as in real time. A cycle waits
    there until codelets have corrected the map or planned a route: a gap may be theirs.
    """
    end_s = time.monotonic() + time_limit_s
    found: dict[float, Stop] = {}
    with (
        closing(Agent(setting.folder, seed, is_lockstep)) as agent,
        bar("stopping a recorder") as progress,
    ):
        wait_until(lambda: _listens(agent), end_s, "the router listened")
        with closing(Witness(agent.endpoint, AGENT)) as witness:
            wait_until(lambda: witness.deltas > FIRST_DELTAS, end_s, "the agent drove")
            for number, stop_s in enumerate(stops_s, 1):
                recorder = agent.recorder(f"stopped-{number}")
                try:
                    found[stop_s] = _stop(agent, witness, recorder, stop_s, end_s)
                finally:
                    recorder.program.abandon()
                progress(number / len(stops_s))

    return _metrics(found)


def _stop(agent: Agent, witness: Witness, recorder: Recorder, stop_s: float, end_s: float) -> Stop:
    wait_until(lambda: recorder.has_begun, end_s, "the recorder wrote")
    wait(BEFORE_S)
    stopped_s = time.monotonic()
    before_s = witness.gap_s(stopped_s - BEFORE_S, stopped_s)
    memory_mb = agent.router.memory_mb
    at_stop = witness.numbers()

    recorder.program.send(signal.SIGSTOP)
    peak_mb = _peak_mb(agent, stopped_s + stop_s)
    at_end = witness.numbers()
    continued_ns = time.time_ns()
    continued_s = time.monotonic()
    recorder.program.send(signal.SIGCONT)
    awaited = last_of_those_that_grew(at_stop, at_end)
    while not has_caught_up(recorder.path, awaited, continued_ns):
        peak_mb = max(peak_mb, _peak_mb(agent, time.monotonic() + LOOK_S))
        if time.monotonic() > end_s:
            break
    recovered_s = time.monotonic() - continued_s
    stopped_gap_s = witness.gap_s(stopped_s, continued_s)
    after_gap_s = witness.gap_s(continued_s, time.monotonic())

    expected = witness.numbers()
    summary = recorder.finish()
    lost = _lost(recorder, expected)
    told = Counter(summary["lost"])
    unsaid = {name: max(0, number - told[name]) for name, number in lost.items()}
    return Stop(
        stopped_gap_s=stopped_gap_s,
        after_gap_s=after_gap_s,
        before_s=before_s,
        missed=_size(at_end) - _size(at_stop),
        again=sum(summary["fetched"].values()),
        lost=lost.total(),
        unsaid=sum(unsaid.values()),
        growth_mb=peak_mb - memory_mb,
        recovered_s=recovered_s,
    )


def _listens(agent: Agent) -> bool:
    return "router listens" in agent.router.log.read_text()


def _peak_mb(agent: Agent, until_s: float) -> float:
    """Watch the router until then. Returns the most memory that it had."""
    peak_mb = agent.router.memory_mb
    while time.monotonic() < until_s:
        wait(POLL_S)
        peak_mb = max(peak_mb, agent.router.memory_mb)
    return peak_mb


def last_of_those_that_grew(
    before: dict[Stream, set[int]], after: dict[Stream, set[int]]
) -> dict[Stream, int]:
    """Return the last number of each stream that has had a message between two moments."""
    last = {}
    for stream, numbers in after.items():
        if numbers - before.get(stream, set()):
            last[stream] = max(numbers)
    return last


def has_caught_up(log: Path, awaited: dict[Stream, int], since_ns: int) -> bool:
    """Return whether the log has the awaited number of each stream, or a later one. It has a stream
    in order, so it has all before that it will have.
    """
    left = dict(awaited)
    for record in LogReader(log).records(NEVER_DROP, start_ns=since_ns):
        envelope = record.envelope
        if envelope is None:
            continue
        stream = (record.topic_name, envelope.source, envelope.incarnation)
        if envelope.seq >= left.get(stream, math.inf):
            del left[stream]
    return not left


def _lost(recorder: Recorder, expected: dict[Stream, set[int]]) -> Counter[str]:
    """Count by topic the messages that the log lacks, of those since its first of each stream."""
    recorded: dict[Stream, set[int]] = defaultdict(set)
    for topic, envelope in sequence_of([recorder.path]):
        recorded[topic.name, envelope.source, envelope.incarnation].add(envelope.seq)

    lost: Counter[str] = Counter()
    for stream, numbers in expected.items():
        there = recorded.get(stream)
        if there:
            first = min(there)
            missing = {number for number in numbers if number > first} - there
            lost[stream[0]] += len(missing)
    return lost


def _size(numbers: dict[Stream, set[int]]) -> int:
    return sum(len(each) for each in numbers.values())


def _metrics(found: dict[float, Stop]) -> Metrics:
    """Return the worst of all stops, and each by its length."""
    stops = found.values()
    metrics: Metrics = {
        "gap_s": max(stop.gap_s for stop in stops),
        "lost": float(sum(stop.lost for stop in stops)),
        "unsaid": float(sum(stop.unsaid for stop in stops)),
        "growth_mb": max(stop.growth_mb for stop in stops),
    }
    for stop_s, stop in found.items():
        prefix = f"stop_{stop_s:g}s"
        metrics[f"{prefix}_gap_s"] = stop.stopped_gap_s
        metrics[f"{prefix}_gap_after_s"] = stop.after_gap_s
        metrics[f"{prefix}_gap_before_s"] = stop.before_s
        metrics[f"{prefix}_missed"] = float(stop.missed)
        metrics[f"{prefix}_fetched"] = float(stop.again)
        metrics[f"{prefix}_lost"] = float(stop.lost)
        metrics[f"{prefix}_growth_mb"] = stop.growth_mb
        metrics[f"{prefix}_recovered_s"] = stop.recovered_s
    return metrics
