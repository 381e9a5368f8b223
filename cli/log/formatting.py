"""What the log commands print."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import click
import msgspec
from rich import box
from rich.console import Console
from rich.table import Table

from cogmap.recording.diff import Diff, TopicDiff
from cogmap.recording.info import Info, TopicInfo
from cogmap.recording.recorder import Summary
from cogmap.recording.replaying.outcome import Outcome, Report
from cogmap.recording.replaying.player import Played
from cogmap.recording.storage.recover import Recovery

_PIPED_WIDTH = 160
_INFO_COLUMNS = ["topic:", "type:", "delivery:", "count", "Hz", "mean size", "lost", "sources:"]
_DIFF_COLUMNS = ["topic:", "left", "right", "same", "different", "left only", "right only"]
_REPLAY_COLUMNS = ["instance:", "life", "inputs", "same", "different", "missing", "s"]


def print_json(value: Any) -> None:
    """One JSON document."""
    click.echo(msgspec.json.format(msgspec.json.encode(value)).decode())


def megabytes(number: float) -> str:
    """A number of bytes, as people read it."""
    return f"{number / 1e6:.1f} MB" if number >= 1e5 else f"{number / 1e3:.1f} kB"


def print_table(columns: list[str], rows: list[list[str]]) -> None:
    """A plain table. A column whose name ends with a colon holds words, any other numbers."""
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in columns:
        holds_words = name.endswith(":")
        shown.add_column(
            name.rstrip(":"), justify="left" if holds_words else "right", overflow="fold"
        )
    for row in rows:
        shown.add_row(*row)

    console = Console(soft_wrap=False, highlight=False)
    if not console.is_terminal:
        console.width = _PIPED_WIDTH
    console.print(shown)


def print_summary(summary: Summary) -> None:
    """How a recording went."""
    number = sum(summary.messages.values())
    click.echo(
        f"{summary.path}: {number} messages on {len(summary.messages)} topics in "
        f"{summary.duration_s:.1f} s, {megabytes(summary.size_bytes)}"
    )
    if summary.never_drop_whole:
        click.echo("No gap in any NEVER_DROP topic.")
    for sentence in summary.gaps:
        click.echo(f"gap: {sentence}")

    losses = {
        "given up by the bus": summary.unrecovered,
        "dropped, as the disk was too slow": summary.dropped,
        "rejected, as no messages of their topic": summary.rejected,
    }
    for reason, counts in losses.items():
        for topic, count in sorted(counts.items()):
            click.echo(f"{topic}: {count} {reason}")


def print_info(info: Info) -> None:
    """What is in a log."""
    began = datetime.fromtimestamp(info.began_ns / 1e9).astimezone()
    click.echo(f"{info.path}: {info.software or 'unknown writer'}, agent {info.agent or 'unknown'}")
    click.echo(
        f"{info.messages} messages in {info.duration_s:.1f} s from {began:%Y-%m-%d %H:%M:%S}, "
        f"{megabytes(info.size_bytes)}"
    )
    print_table(_INFO_COLUMNS, [_info_row(topic) for topic in info.topics])
    for sentence in info.gaps:
        click.echo(f"gap: {sentence}")

    if info.cut_bytes:
        click.echo(
            f"{info.cut_bytes} bytes at its end cannot be read: `cogmap log recover` leaves them "
            "out"
        )
    elif not info.finished:
        click.echo("Its recorder did not end it: it was killed, or is still recording.")
    if info.unknown:
        click.echo(f"topics that this version does not know: {', '.join(info.unknown)}")


def print_diff(diff: Diff) -> None:
    """How two logs compare."""
    print_table(_DIFF_COLUMNS, [_diff_row(topic) for topic in diff.topics])
    for topic in diff.topics:
        if topic.first and topic.first != diff.first:
            click.echo(topic.first)
    verdict = f"First difference: {diff.first}" if diff.first else "The logs hold the same."
    click.echo(verdict)


def print_report(report: Report) -> None:
    """What a replay into modules found."""
    print_table(_REPLAY_COLUMNS, [_replay_row(outcome) for outcome in report.outcomes])
    for outcome in report.outcomes:
        for note in outcome.notes:
            click.echo(f"{outcome.instance}: {note}")
        if outcome.first and outcome.first != report.first:
            click.echo(outcome.first)

    click.echo(
        f"{report.log_s:.1f} s of log in {report.wall_s:.1f} s: {report.speed:.1f} x real time"
    )
    if report.first:
        click.echo(f"First difference: {report.first}")
    else:
        click.echo("Every output is the same to the byte.")


def print_played(played: Played) -> None:
    """What was played onto a bus."""
    number = sum(played.messages.values())
    click.echo(
        f"{number} messages on {len(played.messages)} topics in {played.wall_s:.1f} s, "
        f"at most {played.late_max_s * 1e3:.0f} ms late"
    )


def print_recovery(recovery: Recovery) -> None:
    """What was saved of a log."""
    click.echo(f"{recovery.messages} messages saved from {recovery.chunks} chunks")
    for sentence in recovery.damaged:
        click.echo(f"lost: {sentence}")
    if recovery.whole:
        click.echo("Nothing was wrong with it.")
    else:
        click.echo(
            f"Lost: {recovery.lost_bytes} bytes, with {recovery.lost_messages} messages that an "
            "index names and whatever an unfinished chunk held."
        )


def _info_row(topic: TopicInfo) -> list[str]:
    sources = [f"{source}:{count}" for source, count in topic.sources.items()]
    return [
        topic.topic,
        topic.type,
        topic.delivery,
        str(topic.count),
        f"{topic.rate_hz:.2f}",
        megabytes(topic.mean_bytes) if topic.count else "",
        str(topic.lost),
        " ".join(sources),
    ]


def _diff_row(topic: TopicDiff) -> list[str]:
    return [
        topic.topic,
        str(topic.left),
        str(topic.right),
        str(topic.same),
        str(topic.different),
        str(topic.left_only),
        str(topic.right_only),
    ]


def _replay_row(outcome: Outcome) -> list[str]:
    return [
        outcome.instance,
        str(outcome.incarnation),
        str(outcome.fed),
        str(outcome.same),
        str(outcome.different),
        str(outcome.missing_outputs),
        f"{outcome.busy_s:.2f}",
    ]
