"""Prints what the log commands find."""

from __future__ import annotations

from datetime import datetime

import click

from cogmap.cli.printing import megabytes, print_table
from cogmap.recording.copying import Copied
from cogmap.recording.diff import Diff
from cogmap.recording.info import Info
from cogmap.recording.recorder import Summary
from cogmap.recording.replaying.outcome import Report
from cogmap.recording.replaying.player import Played
from cogmap.recording.storage.recover import Recovery

INFO_COLUMNS = ("topic:", "type:", "delivery:", "count", "Hz", "mean size", "lost", "sources:")
DIFF_COLUMNS = ("topic:", "left", "right", "same", "different", "left only", "right only")
REPLAY_COLUMNS = ("instance:", "life", "inputs", "same", "different", "missing", "s")


def print_summary(summary: Summary) -> None:
    """Print how many messages a recording has, and which it lacks."""
    number = sum(summary.messages.values())
    if not summary.paths:
        click.echo(f"{summary.path}: nothing, as nobody asked for a snapshot: press s")
        return

    click.echo(
        f"{summary.path}: {number} messages on {len(summary.messages)} topics in "
        f"{summary.duration_s:.1f} s, {megabytes(summary.size_bytes)}"
    )
    if len(summary.paths) > 1:
        click.echo(
            f"It is in {len(summary.paths)} files: `cogmap log merge {' '.join(summary.paths)} "
            "-o WHOLE` makes one of them."
        )
    if summary.never_drop_whole:
        click.echo("No gap in any NEVER_DROP topic.")
    for sentence in summary.gaps:
        click.echo(f"gap: {sentence}")

    fetched = sum(summary.fetched.values())
    if fetched:
        click.echo(f"{fetched} messages that the bus did not deliver, from who had published them.")
    left_out = sum(summary.left_out.values())
    if left_out:
        click.echo(f"{left_out} messages left out: it was paused, or no snapshot went back so far.")

    losses = {
        "given up by the bus": summary.unrecovered,
        "dropped, as the disk was too slow": summary.dropped,
        "rejected, as they are not what their topic carries": summary.rejected,
    }
    for reason, counts in losses.items():
        for topic, count in sorted(counts.items()):
            click.echo(f"{topic}: {count} {reason}")


def print_info(info: Info) -> None:
    """Print the topics of a log, and what is missing."""
    began = datetime.fromtimestamp(info.began_ns / 1e9).astimezone()
    click.echo(f"{info.path}: {info.software or 'unknown writer'}, agent {info.agent or 'unknown'}")
    click.echo(
        f"{info.messages} messages in {info.duration_s:.1f} s from {began:%Y-%m-%d %H:%M:%S}, "
        f"{megabytes(info.size_bytes)}"
    )
    rows = [
        (
            topic.topic,
            topic.type,
            topic.delivery,
            topic.count,
            f"{topic.rate_hz:.2f}",
            megabytes(topic.mean_bytes) if topic.count else "",
            topic.lost,
            " ".join(f"{source}:{count}" for source, count in topic.sources.items()),
        )
        for topic in info.topics
    ]
    print_table(INFO_COLUMNS, rows)
    for sentence in info.gaps:
        click.echo(f"gap: {sentence}")

    if info.cut_bytes:
        click.echo(
            f"{info.cut_bytes} bytes at its end cannot be read: `cogmap log recover` saves the rest"
        )
    elif not info.finished:
        click.echo("The recording has no end: its recorder was killed, or is still recording.")
    if info.unknown:
        click.echo(f"topics that this version does not know: {', '.join(info.unknown)}")


def print_diff(diff: Diff) -> None:
    """Print how many messages of two logs are the same, and the first that differ."""
    rows = [
        (
            topic.topic,
            topic.left,
            topic.right,
            topic.same,
            topic.different,
            topic.left_only,
            topic.right_only,
        )
        for topic in diff.topics
    ]
    print_table(DIFF_COLUMNS, rows)
    for topic in diff.topics:
        if topic.first and topic.first != diff.first:
            click.echo(topic.first)
    verdict = f"First difference: {diff.first}" if diff.first else "The logs hold the same."
    click.echo(verdict)


def print_report(report: Report) -> None:
    """Print how many outputs of replayed modules are as recorded, and the first that is not."""
    rows = [
        (
            outcome.instance,
            outcome.incarnation,
            outcome.fed,
            outcome.same,
            outcome.different,
            outcome.missing_outputs,
            f"{outcome.busy_s:.2f}",
        )
        for outcome in report.outcomes
    ]
    print_table(REPLAY_COLUMNS, rows)
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
    """Print how many messages were played onto a bus."""
    number = sum(played.messages.values())
    click.echo(
        f"{number} messages on {len(played.messages)} topics in {played.wall_s:.1f} s, "
        f"at most {played.late_max_s * 1e3:.0f} ms late"
    )


def print_recovery(recovery: Recovery) -> None:
    """Print what was saved of a damaged log, and what was lost."""
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


def print_exported(written: dict[str, dict[str, int]]) -> None:
    """Print how many messages were written of each topic, by the place that they are in."""
    for place, counts in written.items():
        click.echo(f"{place}: {len(counts)} topics")
        for name, count in counts.items():
            click.echo(f"  {name}: {count}")


def print_copied(copied: Copied) -> None:
    """Print what is in a log that was made of others."""
    number = sum(copied.messages.values())
    click.echo(
        f"{copied.path}: {number} messages on {len(copied.messages)} topics in "
        f"{copied.duration_s:.1f} s, {megabytes(copied.size_bytes)}"
    )
    if copied.twice:
        click.echo(f"{copied.twice} messages were in several logs, and are there once")
    for name in copied.unknown:
        click.echo(f"left out: {name}, which is no topic of this version")
