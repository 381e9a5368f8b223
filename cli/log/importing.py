"""`cogmap log import`: a bag of ROS as a log of ours."""

from __future__ import annotations

import json
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import click
from mcap.writer import CompressionType
from msgspec.structs import replace

from cogmap.bus.codec import Envelope, encode
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.recording.selection import to_record
from cogmap.recording.storage.reader import Progress
from cogmap.recording.storage.writer import LogWriter
from cogmap.runtime import config
from cogmap.runtime.program import set_option
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.process import Playback
from cogmap.services import registry
from cogmap.services.player import formats
from cogmap.services.player.config import Config
from cogmap.services.player.playhead import Playhead
from cogmap.services.player.recording import Recording

_EPILOG = """\b
Examples:
  cogmap log import drive.bag drive.mcap
  cogmap log import bag drive.mcap --set player.odometry_topic=/odometry/filtered
  cogmap run --recording log:drive.mcap --lockstep
"""


@dataclass
class Imported:
    """How many views were written, and how many left out for which reasons."""

    views: int = 0
    skipped: int = 0
    reasons: list[str] = field(default_factory=list)
    messages: Counter[str] = field(default_factory=Counter)


@click.command("import", epilog=_EPILOG)
@click.argument("bag", type=click.Path(path_type=Path))
@click.argument("log", type=click.Path(path_type=Path))
@set_option
@json_option
def import_bag(bag: Path, log: Path, settings: tuple[str, ...], as_json: bool) -> None:
    """Write the senses in BAG as the new log LOG, which `cogmap run --recording log:LOG` plays.

    BAG is a bag of ROS 1, the folder of one of ROS 2, or an MCAP file of ROS 2, as `cogmap run
    --recording bag:BAG` plays it; --set names the topics where it has several.
    """
    imported = import_senses(bag, log, settings)
    if as_json:
        print_json(imported)
    else:
        print_imported(imported, log)


def print_imported(imported: Imported, log: Path) -> None:
    """Print how many views are in a log that was made of a bag, and what is left out."""
    click.echo(f"{log}: {imported.views} views, {imported.skipped} left out")
    for reason in imported.reasons:
        click.echo(f"  {reason}")


def import_senses(
    bag: Path,
    log: Path,
    settings: tuple[str, ...],
    compression: CompressionType = CompressionType.LZ4,
) -> Imported:
    """Write the senses in a bag as a new log; `settings` are of --set. Raises UsageError if the bag
    cannot be played, and LogError if the log exists or the disk refuses.
    """
    named = f"bag:{bag}"
    player = config.load(None, settings).get(registry.PLAYER, {}) | {"recording": named}
    sections = {registry.PLAYER: player}
    with bar(f"reading {bag}"):
        recording = formats.opened(config.typed(sections, registry.PLAYER, Config))
    with bar(f"writing {log}") as progress:
        return write_senses(recording, formats.named(named).title, log, compression, progress)


def write_senses(
    recording: Recording,
    title: str,
    path: Path,
    compression: CompressionType,
    progress: Progress,
) -> Imported:
    """Write what a recording plays as the log of a run in which it was played, with the settings
    that it asks for. Raises LogError if the file exists, or the disk refuses.
    """
    began_ns = time.time_ns()
    about = {"config": json.dumps(recording.settings), "began_ns": str(began_ns)}
    writer = LogWriter(path, to_record(), about, compression)
    playhead = Playhead(recording, title)
    imported = Imported()

    def write(message: Message) -> None:
        topic = topics.of(message)
        seq = imported.messages[topic.name]
        imported.messages[topic.name] += 1
        at_ns = began_ns + message.stamp_ns
        envelope = Envelope(registry.PLAYER, seq, began_ns, at_ns, at_ns)
        sensed = replace(message, source=registry.PLAYER, seq=seq)
        writer.write(topic, encode(sensed), envelope, at_ns)

    while (step := playhead.advance()) is not None:
        for message in [*step.before, *step.truth, *step.view]:
            write(message)
            if isinstance(message, Playback):
                imported.reasons += message.reasons
                progress(message.progress)
    over = playhead.end()
    write(over)
    writer.close()

    imported.views = over.views
    imported.skipped = over.skipped
    imported.reasons += over.reasons
    return imported
