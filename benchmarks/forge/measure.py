"""The metrics of forge: what lies do to an agent that drives."""

from __future__ import annotations

import time
from collections.abc import Sequence
from itertools import count
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from benchmarks.benchmark import Setting
from benchmarks.forge.cases import Case, Mode, every, selected
from benchmarks.forge.outcome import Outcome
from benchmarks.forge.trial import PATIENCE_S, Driving, Trial
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.cli.progress import bar
from cogmap.errors import CogmapError

THRESHOLDS = {
    "stopped_for_good": at_most(0),
    "steered": at_most(0),
    "forked_unsaid": at_most(0),
    "recovered_s_max": at_most(5),
    "unnamed": at_most(0),
}
TIME_LIMIT_S = 7200.0
OPTIONS = (
    click.Option(
        ["--seed"],
        type=click.IntRange(0, 2**32),
        default=1,
        show_default=True,
        help="Of the town, and of which cases are drawn.",
    ),
    click.Option(
        ["--cases"],
        type=click.IntRange(1, 100_000),
        help="So many, drawn from all.  [default: all]",
    ),
    click.Option(
        ["--time-limit-s"],
        type=click.FloatRange(30, 1e6),
        default=TIME_LIMIT_S,
        show_default=True,
        help="Begin no case after that.",
    ),
    click.Option(
        ["--only"],
        multiple=True,
        metavar="TOPIC/KIND",
        help="Just this case, all of a TOPIC or a module, or all of a /KIND; repeatable.",
    ),
    click.Option(
        ["--lockstep/--real-time", "is_lockstep"],
        default=None,
        help="Only in lockstep, or only in real time.  [default: both]",
    ),
)


def measure(
    setting: Setting,
    *,
    seed: int = 1,
    cases: int | None = None,
    time_limit_s: float = TIME_LIMIT_S,
    only: Sequence[str] = (),
    is_lockstep: bool | None = None,
) -> Metrics:
    """Measure what lies do to an agent: messages that make sense but for one thing, put by a
    stranger while it drives.

    Every module is a process, at a router of its own on this machine. A lie repeats the newest
    message of a topic with one thing changed, for a second, just after each true one: a stamp, a
    cycle, a version or a number that is far, the source, its incarnation; or it is repeated 5,000
    times a second for two seconds; or a token names a module that is not there; or a module is
    started twice. What would be carried out also commands what the agent would not: to drive
    backwards, or a turn of 2.71828 rad. What people may publish is no lie under another name.

    \b
    stopped_for_good  cases after which no wheel was commanded to turn by the agent's own motor for
                      5 s, or the drive ended
    steered           cases in which the robot drove backwards faster than it ever does by itself,
                      or sensory-motor memory executed the turn
    forked_unsaid     cases 5 s after which a graph that follows the workspace's differs from its
                      snapshot of the same version, and nobody named anything
    recovered_s_max   seconds from the last lie of a case until commands come as often as before and
                      no more messages of its topic are rejected; 8 if that was not seen
    unnamed           cases of which no log names topic or stranger, no health counts a rejected or
                      lost message of it or has a new note, and doctor finds nothing new about it

    One drive serves many cases: it is restarted where one stopped it, or left its graph forked.
    Takes up to two hours; --time-limit-s and half a minute are its bound. For instance

    \b
    python -m benchmarks forge --only clock/far-stamp --real-time
    python -m benchmarks forge --seed 3 --cases 40 --json forge.json
    """
    modes = [mode for mode in Mode if is_lockstep in (None, mode is Mode.LOCKSTEP)]
    chosen = selected(every(modes), cases, seed, only)
    outcomes = tell(chosen, setting.folder, seed, time_limit_s, setting)
    Console().print(table(outcomes))
    return metrics(outcomes, len(chosen))


def tell(
    chosen: Sequence[Case], folder: Path, seed: int, time_limit_s: float, setting: Setting
) -> list[Outcome]:
    """Tell the lies of each case, and return what became of them."""
    began_s = time.monotonic()
    outcomes: list[Outcome] = []
    driving: Driving | None = None
    numbers = count(1)
    try:
        with bar("lies") as progress:
            for case in chosen:
                left_s = began_s + time_limit_s - time.monotonic()
                if left_s <= 0:
                    break
                if driving is not None and (
                    driving.mode is not case.mode
                    or driving.system.has_ended
                    or not driving.await_motion(PATIENCE_S)
                ):
                    driving.close()
                    driving = None
                if driving is None:
                    driving = Driving(folder / f"drive-{next(numbers)}", case.mode, seed, 3600)
                outcome = Trial(driving, case).run()
                outcomes.append(outcome)
                setting.announce(line(outcome))
                if not outcome.is_clean:
                    driving.close()
                    driving = None
                progress(len(outcomes) / len(chosen))
    finally:
        if driving is not None:
            driving.close()
    return outcomes


def line(outcome: Outcome) -> str:
    """Return what became of a case, for who waits."""
    failures = ", ".join(outcome.failures) or "ok"
    recovered = "never" if outcome.recovered_s is None else f"{outcome.recovered_s:.1f} s"
    named = outcome.named_by[0][:110] if outcome.named_by else "-"
    return (
        f"{outcome.case}: {failures}; lies {outcome.lies}, stood {outcome.stood_s:.1f} s, itself "
        f"{recovered}{', ended' if outcome.ended else ''} {outcome.remark}; named: {named}"
    )


def table(outcomes: Sequence[Outcome]) -> Table:
    """Return the table of cases and what became of them."""
    made = Table(title="lies")
    for heading in ("case", "lies", "stood s", "itself after s", "failed", "named by"):
        made.add_column(heading)
    for outcome in outcomes:
        recovered = "never" if outcome.recovered_s is None else f"{outcome.recovered_s:.1f}"
        made.add_row(
            str(outcome.case),
            str(outcome.lies),
            f"{outcome.stood_s:.1f}",
            recovered,
            ", ".join(outcome.failures),
            outcome.named_by[0] if outcome.named_by else "",
        )
    return made


def metrics(outcomes: Sequence[Outcome], chosen: int) -> Metrics:
    """Return the metrics of the outcomes, of so many cases chosen."""
    if not outcomes:
        raise CogmapError("no case was run: allow more with --time-limit-s")
    recovered = [
        PATIENCE_S if each.recovered_s is None else max(each.recovered_s, 0.0) for each in outcomes
    ]
    return {
        "stopped_for_good": float(sum(each.has_stopped for each in outcomes)),
        "steered": float(sum(each.is_steered for each in outcomes)),
        "forked_unsaid": float(sum(each.is_forked_unsaid for each in outcomes)),
        "recovered_s_max": max(recovered),
        "unnamed": float(sum(not each.named_by for each in outcomes)),
        "cases": float(len(outcomes)),
        "cases_left_out": float(chosen - len(outcomes)),
    }
