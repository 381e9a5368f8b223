"""The metrics of forge: what lies do to an agent that drives."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from benchmarks.benchmark import Setting
from benchmarks.forge.cases import Case, Mode, every, selected
from benchmarks.forge.driving import Driving
from benchmarks.forge.outcome import Outcome
from benchmarks.forge.trial import PATIENCE_S, Trial
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
LINE = 160
GRACE_S = 180.0
"""So much longer than the campaign a drive lasts whose campaign was killed."""

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
    Takes up to two hours, and at most five minutes more than --time-limit-s. For instance

    \b
    python -m benchmarks forge --only clock/far-stamp --real-time
    python -m benchmarks forge --seed 3 --cases 40 --json forge.json
    """
    modes = [mode for mode in Mode if is_lockstep in (None, mode is Mode.LOCKSTEP)]
    chosen = selected(every(modes), cases, seed, only)
    outcomes: list[Outcome] = []
    campaign = Campaign(setting.folder, seed, time_limit_s)
    try:
        with bar("lies") as progress:
            for case in chosen:
                if campaign.left_s <= 0:
                    break
                outcome = campaign.tell(case)
                outcomes.append(outcome)
                setting.announce(line(outcome))
                progress(len(outcomes) / len(chosen))
    except CogmapError as error:
        if not outcomes:
            raise
        setting.announce(f"the rest is left out: {error}")
    finally:
        campaign.close()

    console = Console()
    console.print(table(outcomes))
    failed = [str(outcome.case) for outcome in outcomes if outcome.failures]
    console.print(f"failed, {len(failed)} of {len(outcomes)}: {', '.join(failed) or 'none'}")
    return metrics(outcomes, len(chosen))


class Campaign:
    """Tells the lies of one case after the other, to a drive that is restarted where one stopped it
    or left it another than it was. Its files are in `folder`. `close` it in the end.
    """

    def __init__(self, folder: Path, seed: int, time_limit_s: float) -> None:
        self._folder = folder
        self._seed = seed
        self._until_s = time.monotonic() + time_limit_s
        self._driving: Driving | None = None
        self._drives = 0

    @property
    def left_s(self) -> float:
        """Return how much of its time is left."""
        return self._until_s - time.monotonic()

    def tell(self, case: Case) -> Outcome:
        """Tell the lies of `case`, and return what became of them."""
        driving = self._driving_in(case.mode)
        outcome = Trial(driving, case).run()
        if not outcome.is_clean:
            self.close()
        return outcome

    def close(self) -> None:
        """End the drive."""
        if self._driving is not None:
            self._driving.close()
            self._driving = None

    def _driving_in(self, mode: Mode) -> Driving:
        """Return a drive in which the robot moves."""
        driving = self._driving
        if driving is not None and driving.mode is mode and driving.await_motion(PATIENCE_S):
            return driving

        self.close()
        try:
            self._driving = self._started(mode)
        except CogmapError:  # once more: a machine that is busy with others may be too late
            self._driving = self._started(mode)
        return self._driving

    def _started(self, mode: Mode) -> Driving:
        self._drives += 1
        folder = self._folder / f"drive-{self._drives}"
        limit_s = max(0.0, self.left_s) + GRACE_S
        return Driving(folder, mode, self._seed, limit_s)


def line(outcome: Outcome) -> str:
    """Return what became of a case, for who waits."""
    failures = ", ".join(outcome.failures) or "ok"
    named = outcome.named_by[0] if outcome.named_by else "nobody"
    remark = f"; {outcome.remark}" if outcome.remark else ""
    return (
        f"{outcome.case}: {failures}; lies {outcome.lies}, stood {outcome.stood_s:.1f} s, itself "
        f"after {_recovered(outcome)} s{remark}; named by {named[:LINE]}"
    )


def table(outcomes: Sequence[Outcome]) -> Table:
    """Return the table of cases and what became of them."""
    made = Table(title="lies")
    made.add_column("case", no_wrap=True)
    for heading in ("lies", "stood s", "itself s"):
        made.add_column(heading, justify="right")
    made.add_column("failed")

    for outcome in outcomes:
        failures = ", ".join(outcome.failures)
        made.add_row(
            str(outcome.case),
            str(outcome.lies),
            f"{outcome.stood_s:.1f}",
            _recovered(outcome),
            f"[red]{failures}" if failures else "[green]none",
        )
    return made


def _recovered(outcome: Outcome) -> str:
    return "never" if outcome.recovered_s is None else f"{outcome.recovered_s:.1f}"


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
