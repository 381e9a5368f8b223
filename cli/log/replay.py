"""`cogmap log replay`: onto a bus, or into modules."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.log import formatting
from cogmap.cli.log.keys import Keys
from cogmap.cli.log.progress import bar
from cogmap.cli.options import (
    FiniteRange,
    agent_option,
    config_option,
    connect_option,
    json_option,
    set_option,
)
from cogmap.recording import selection
from cogmap.recording.replaying.player import Choices, Player
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime import config
from cogmap.runtime.process import Stop
from cogmap.services import registry

CLOCK_HZ = 40.0
_EPILOG = """\b
Examples:
  cogmap log replay drive.mcap                      onto the bus, as it was
  cogmap log replay drive.mcap -r 2 -l              twice as fast, again and again
  cogmap log replay drive.mcap --topics odometry --topics camera/stereo --clock
  cogmap log replay drive.mcap --into sensory       does it still publish the same?
  cogmap log replay drive.mcap --into epam --set epam.percept_threshold=0.6
"""


@click.command(epilog=_EPILOG)
@click.argument("log", type=click.Path(path_type=Path))
@click.option("-r", "--rate", type=FiniteRange(min=0, min_open=True), help="So many times as fast.")
@click.option("--topics", multiple=True, metavar="TOPIC", help="Only this one; repeat at will.")
@click.option("--start-offset", type=FiniteRange(min=0), help="Begin so many seconds into the log.")
@click.option("-l", "--loop", is_flag=True, help="Begin again at the end.")
@click.option(
    "--start-paused", is_flag=True, help="Begin paused; the space bar continues and pauses."
)
@click.option(
    "--clock",
    "clock_hz",
    type=FiniteRange(min=0, min_open=True),
    is_flag=False,
    flag_value=CLOCK_HZ,
    metavar="[HZ]",
    help=f"Publish on the clock how far it is, so often a second ({CLOCK_HZ:g} unless given).",
)
@click.option(
    "--into", multiple=True, metavar="MODULE", help="Feed this module and compare; repeat at will."
)
@connect_option
@agent_option
@config_option
@set_option
@json_option
def replay(
    log: Path,
    rate: float | None,
    topics: tuple[str, ...],
    start_offset: float | None,
    loop: bool,
    start_paused: bool,
    clock_hz: float | None,
    into: tuple[str, ...],
    connect: str,
    agent: str,
    config_path: Path | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """Play LOG back onto the bus, or feed it to modules with --into.

    With --into, each recorded instance of the module receives what it received then, in the same
    order and with the recorded configuration, and what it publishes is compared with the log: exit
    code 1, and the first difference in words, where a byte differs.
    """
    overrides = config.load(config_path, settings)
    if into:
        if rate or topics or start_offset or loop or start_paused or clock_hz:
            raise click.UsageError(
                "--into replays everything as fast as it can: leave the options of playing out"
            )
        _into(log, into, overrides, as_json)
        return

    if overrides:
        raise click.UsageError("--config and --set are for --into: messages are played as they are")
    choices = Choices(
        rate=rate or 1.0,
        topics=selection.named(topics) or None,
        start_offset_s=start_offset or 0.0,
        loop=loop,
        clock_hz=clock_hz or 0.0,
    )
    _onto_bus(LogReader(log), choices, ZenohBus(connect, agent), start_paused, as_json)


def _into(log: Path, modules: tuple[str, ...], overrides: config.Sections, as_json: bool) -> None:
    for name in modules:
        registry.config_type(name)

    with bar(f"replaying {', '.join(modules)}") as progress:
        report = replay_into(log, modules, registry.build, overrides=overrides, progress=progress)
    if as_json:
        formatting.print_json(report)
    else:
        formatting.print_report(report)
    if not report.same:
        sys.exit(1)


def _onto_bus(
    reader: LogReader, choices: Choices, bus: ZenohBus, start_paused: bool, as_json: bool
) -> None:
    try:
        with Keys(Stop(), start_paused).listening() as keys:
            played = Player(reader, bus, choices, keys).play()
    finally:
        bus.close()

    if as_json:
        formatting.print_json(played)
    else:
        formatting.print_played(played)
