"""What the log commands print."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import click
import msgspec
from rich import box
from rich.console import Console
from rich.table import Table

from cogmap.recording.diff import Diff
from cogmap.recording.info import Info
from cogmap.recording.recorder import Summary
from cogmap.recording.replaying.player import Played
from cogmap.recording.replaying.replay import Report
from cogmap.recording.storage.recover import Recovery

_PIPED_WIDTH = 160


def say_json(value: Any) -> None:
    """One JSON document."""
    click.echo(msgspec.json.format(msgspec.json.encode(value)).decode())


def megabytes(number: float) -> str:
    """A number of bytes, as people read it."""
    return f"{number / 1e6:.1f} MB" if number >= 1e5 else f"{number / 1e3:.1f} kB"


def table(columns: list[str], rows: list[list[str]]) -> None:
    """A plain table; columns after the first are numbers unless they are called in lower case with
    a colon.
    """
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in columns:
        shown.add_column(
            name.rstrip(":"), justify="left" if name.endswith(":") else "right", overflow="fold"
        )
    for row in rows:
        shown.add_row(*row)
    console = Console(soft_wrap=False, highlight=False)
    if not console.is_terminal:
        console.width = _PIPED_WIDTH
    console.print(shown)


def say_summary(summary: Summary) -> None:
    """How a recording went."""
    number = sum(summary.messages.values())
    click.echo(
        f"{summary.path}: {number} messages on {len(summary.messages)} topics in {summary.duration_s:.1f} s, "
        f"{megabytes(summary.size_bytes)}"
    )
    if summary.never_drop_whole:
        click.echo("No gap in any NEVER_DROP topic.")
    for sentence in summary.gaps:
        click.echo(f"gap: {sentence}")
    for what, counts in (
        ("given up by the bus", summary.unrecovered),
        ("dropped, as the disk was too slow", summary.dropped),
        ("rejected, as no messages of their topic", summary.rejected),
    ):
        for topic, count in sorted(counts.items()):
            click.echo(f"{topic}: {count} {what}")


def say_info(info: Info) -> None:
    """What is in a log."""
    began = datetime.fromtimestamp(info.began_ns / 1e9).astimezone()
    click.echo(f"{info.path}: {info.software or 'unknown writer'}, agent {info.agent or 'unknown'}")
    click.echo(
        f"{info.messages} messages in {info.duration_s:.1f} s from {began:%Y-%m-%d %H:%M:%S}, "
        f"{megabytes(info.size_bytes)}"
    )
    rows = [
        [
            topic.topic,
            topic.type,
            topic.delivery,
            str(topic.count),
            f"{topic.rate_hz:.2f}",
            megabytes(topic.mean_bytes) if topic.count else "",
            str(topic.lost),
            " ".join(f"{source}:{count}" for source, count in topic.sources.items()),
        ]
        for topic in info.topics
    ]
    table(["topic:", "type:", "delivery:", "count", "Hz", "mean size", "lost", "sources:"], rows)
    for sentence in info.gaps:
        click.echo(f"gap: {sentence}")
    if info.cut_bytes:
        click.echo(
            f"{info.cut_bytes} bytes at its end cannot be read: `cogmap log recover` leaves them out"
        )
    elif not info.finished:
        click.echo("Its recorder did not end it: it was killed, or is still recording.")
    if info.unknown:
        click.echo(f"topics that this version does not know: {', '.join(info.unknown)}")


def say_diff(diff: Diff) -> None:
    """How two logs compare."""
    rows = [
        [
            t.topic,
            str(t.left),
            str(t.right),
            str(t.same),
            str(t.different),
            str(t.left_only),
            str(t.right_only),
        ]
        for t in diff.topics
    ]
    table(["topic:", "left", "right", "same", "different", "left only", "right only"], rows)
    for topic in diff.topics:
        if topic.first and topic.first != diff.first:
            click.echo(topic.first)
    click.echo(f"First difference: {diff.first}" if diff.first else "The logs say the same.")


def say_report(report: Report) -> None:
    """What a replay into modules found."""
    rows = [
        [
            outcome.instance,
            str(outcome.incarnation),
            str(outcome.fed),
            str(outcome.same),
            str(outcome.different),
            str(outcome.unsaid),
            f"{outcome.busy_s:.2f}",
        ]
        for outcome in report.outcomes
    ]
    table(["instance:", "life", "inputs", "same", "different", "unsaid", "s"], rows)
    for outcome in report.outcomes:
        for note in outcome.notes:
            click.echo(f"{outcome.instance}: {note}")
        if outcome.first and outcome.first != report.first:
            click.echo(outcome.first)
    click.echo(
        f"{report.log_s:.1f} s of log in {report.wall_s:.1f} s: {report.speed:.1f} x real time"
    )
    click.echo(
        f"First difference: {report.first}"
        if report.first
        else "Every output is the same to the byte."
    )


def say_played(played: Played) -> None:
    """What was played onto a bus."""
    number = sum(played.messages.values())
    click.echo(
        f"{number} messages on {len(played.messages)} topics in {played.wall_s:.1f} s, "
        f"at most {played.late_max_s * 1e3:.0f} ms late"
    )


def say_recovery(recovery: Recovery) -> None:
    """What was saved of a log."""
    click.echo(f"{recovery.messages} messages saved from {recovery.chunks} chunks")
    for sentence in recovery.damaged:
        click.echo(f"lost: {sentence}")
    if recovery.whole:
        click.echo("Nothing was wrong with it.")
    else:
        click.echo(
            f"Lost: {recovery.lost_bytes} bytes, with {recovery.lost_messages} messages that an index tells of"
            " and whatever an unfinished chunk held."
        )
