"""`cogmap log info`, `cat`, `diff` and `recover`."""

from __future__ import annotations

import sys
from itertools import islice
from pathlib import Path
from typing import Any

import click
import msgspec

from cogmap.cli.log import report
from cogmap.cli.log.choosing import check_span, start_option, until_option
from cogmap.cli.messages.condition import ALWAYS, Condition, filter_option, parsed
from cogmap.cli.messages.style import Form, Style, style_options
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.cli.topic.argument import topics_argument
from cogmap.errors import MessageError, UsageError
from cogmap.recording import diff as differ
from cogmap.recording import info as informer
from cogmap.recording import selection
from cogmap.recording.storage import recover as rescuer
from cogmap.recording.storage.format import MAX_TIME_NS
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.schemas.render import to_jsonable

_CAT_EPILOG = """\b
Examples:
  cogmap log cat drive.mcap action/selected
  cogmap log cat drive.mcap odometry -n 3
  cogmap log cat drive.mcap motor/command --filter "halted_by == obstacle"
  cogmap log cat drive.mcap truth/pose --field pose.x_m --field pose.y_m --csv
  cogmap log cat drive.mcap --json --full sensory/scan | jq .message.range_m
"""
_DIFF_EPILOG = """\b
Examples:
  cogmap log diff monday.mcap tuesday.mcap
  cogmap log diff a.mcap b.mcap workspace/delta
"""
log_argument = click.argument("log", type=click.Path(path_type=Path))


@click.command()
@log_argument
@json_option
def info(log: Path, as_json: bool) -> None:
    """Show the length, size, topics and publishers of LOG, and what is missing in it."""
    with bar(f"reading {log.name}") as progress:
        found = informer.info(log, progress)
    if as_json:
        print_json(found)
    else:
        report.print_info(found)


@click.command(epilog=_CAT_EPILOG)
@log_argument
@topics_argument
@click.option("-n", "number", type=click.IntRange(min=1), help="Print at most this many messages.")
@start_option
@until_option
@filter_option
@style_options
def cat(
    log: Path,
    topics: tuple[str, ...],
    number: int | None,
    start_s: float,
    until_s: float | None,
    condition: str | None,
    style: Style,
) -> None:
    """Print the messages in LOG, of all topics or of TOPICS, as `cogmap topic echo` does.

    With --json each has its topic, time and envelope beside it.
    """
    check_span(start_s, until_s)
    chosen = selection.named(topics)
    if (condition is not None or style.fields) and len(chosen) != 1:
        raise UsageError("--filter and --field are for the messages of one topic: name it")
    wanted = parsed(condition, chosen[0]) if condition is not None else ALWAYS

    reader = LogReader(log)
    begin_ns = reader.span_ns[0]
    start_ns = begin_ns + int(start_s * 1e9)
    end_ns = MAX_TIME_NS if until_s is None else begin_ns + int(until_s * 1e9)
    records = reader.records(chosen or None, start_ns=start_ns, end_ns=end_ns)
    meant = (record for record in records if _is_meant(reader, record, wanted))
    for record in islice(meant, number):
        write = _as_json if style.form is Form.JSON else _as_text
        click.echo(write(reader, record, style))


@click.command(epilog=_DIFF_EPILOG)
@click.argument("left", type=click.Path(path_type=Path))
@click.argument("right", type=click.Path(path_type=Path))
@topics_argument
@json_option
def diff(left: Path, right: Path, topics: tuple[str, ...], as_json: bool) -> None:
    """Compare two logs message by message, on all topics of the model or on TOPICS.

    Ends with 1 if a byte differs, and describes the first difference. Times of sending and
    receiving are not compared.
    """
    with bar("comparing") as progress:
        found = differ.diff(left, right, selection.named(topics) or None, progress)
    if as_json:
        print_json(found)
    else:
        report.print_diff(found)
    if not found.same:
        sys.exit(1)


@click.command()
@click.argument("source", metavar="IN", type=click.Path(path_type=Path))
@click.argument("target", metavar="OUT", type=click.Path(path_type=Path))
@json_option
def recover(source: Path, target: Path, as_json: bool) -> None:
    """Save what is readable of IN, a log that was cut off or damaged, as the new log OUT."""
    with bar(f"recovering {source.name}") as progress:
        recovery = rescuer.recover(source, target, progress)
    if as_json:
        print_json(recovery)
    else:
        report.print_recovery(recovery)


def _is_meant(reader: LogReader, record: Record, wanted: Condition) -> bool:
    """Decide whether a message is to be printed: one that cannot be read is, with the reason."""
    if wanted is ALWAYS:
        return True
    try:
        return wanted.holds(reader.message(record))
    except MessageError:
        return True


def _as_json(reader: LogReader, record: Record, style: Style) -> str:
    facts: dict[str, Any] = {"topic": record.topic_name, "log_time_ns": record.log_time_ns}
    if record.envelope is not None:
        facts["envelope"] = to_jsonable(record.envelope)
    try:
        facts["message"] = style.jsonable(reader.message(record))
    except MessageError as error:
        facts["error"] = str(error)
    return msgspec.json.encode(facts).decode()


def _as_text(reader: LogReader, record: Record, style: Style) -> str:
    try:
        text = style.text(reader.message(record), reader.payload(record))
    except MessageError as error:
        text = f"# {error}"

    if style.form not in (Form.TEXT, Form.FLOW):
        return text
    at_s = (record.log_time_ns - reader.span_ns[0]) / 1e9
    return f"--- {record.topic_name} at {at_s:.3f} s\n{text}"
