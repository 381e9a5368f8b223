"""`cogmap log replay`: onto a bus, or into modules."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from cogmap.bus.access.subjects import REPLAY
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.log import report
from cogmap.cli.log.choosing import (
    check_span,
    exclude_option,
    regex_option,
    start_option,
    until_option,
)
from cogmap.cli.log.keys import ReplayKeys
from cogmap.cli.options import FiniteRange, json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.recording import selection
from cogmap.recording.replaying.player import Choices, Player
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime import config, environment
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, config_option, connect_option, set_option
from cogmap.services import registry

CLOCK_HZ = 40.0
_EPILOG = """\b
Examples:
  cogmap log replay drive.mcap                      onto the bus, as recorded
  cogmap log replay drive.mcap -r 2 -l              twice as fast, again and again
  cogmap log replay drive.mcap --topics odometry --topics camera/stereo --clock
  cogmap log replay drive.mcap -x '^truth/' --start-offset 10 --until 20
  cogmap log replay drive.mcap --agent ghost        beside a running agent, under another name
  cogmap log replay drive.mcap --into sensory       is its output still the same?
  cogmap log replay drive.mcap --into epam --set epam.percept_threshold=0.6
"""


@click.command(epilog=_EPILOG)
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "-r", "--rate", type=FiniteRange(min=0, min_open=True), help="Play this many times as fast."
)
@click.option(
    "--topics", multiple=True, metavar="TOPIC", help="Play only this topic; may be repeated."
)
@regex_option
@exclude_option
@start_option
@until_option
@click.option("-l", "--loop", is_flag=True, help="Play again and again.")
@click.option("--start-paused", is_flag=True, help="Begin paused; keys continue, step and pause.")
@click.option(
    "--clock",
    "clock_hz",
    type=FiniteRange(min=0, min_open=True),
    is_flag=False,
    flag_value=CLOCK_HZ,
    metavar="[HZ]",
    help=f"Publish the time of the log on the clock, at this rate.  [default: {CLOCK_HZ:g}]",
)
@click.option(
    "--into",
    multiple=True,
    metavar="MODULE",
    help="Feed the log to this module and compare; may be repeated.",
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
    regex: str,
    exclude: str,
    start_s: float,
    until_s: float | None,
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

    On a terminal the space bar pauses and continues, and s goes on by a view.

    With --into, each recorded instance of the module receives the recorded messages in the same
    order, with the recorded configuration, and its output is compared with the log. Ends with 1 if
    a byte differs, and describes the first difference.
    """
    overrides = config.load(config_path, settings)
    if into:
        chosen = (topics, regex, exclude, start_s, until_s)
        if rate or any(chosen) or loop or start_paused or clock_hz:
            raise click.UsageError(
                "--into replays everything as fast as it can: leave out the options of playing"
            )
        for name in into:
            registry.config_type(name)

        with bar(f"replaying {', '.join(into)}") as progress:
            found = replay_into(log, into, registry.build, overrides=overrides, progress=progress)
        if as_json:
            print_json(found)
        else:
            report.print_report(found)
        if not found.same:
            sys.exit(1)
        return

    if overrides:
        raise click.UsageError("--config and --set are for --into: messages are played as they are")
    check_span(start_s, until_s)
    choices = Choices(
        rate=rate or 1.0,
        topics=selection.to_play(topics, regex, exclude),
        start_offset_s=start_s,
        end_s=until_s,
        loop=loop,
        clock_hz=clock_hz or 0.0,
    )
    reader = LogReader(log)
    bus = ZenohBus(connect, agent, keys=environment.keys(REPLAY))
    try:
        keys = ReplayKeys(Stop(), start_paused)
        with keys.listening(), bar(f"playing {log}") as progress:
            played = Player(reader, bus, choices, keys).play(progress)
    finally:
        bus.close()

    if as_json:
        print_json(played)
    else:
        report.print_played(played)
