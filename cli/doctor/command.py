"""`cogmap doctor`: what is wrong with this installation and with the system that runs."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import click
import msgspec

from cli.doctor import installation, system
from cli.doctor.finding import Finding
from cli.doctor.system import Observed
from cli.options import agent_option, connect_option, json_option
from cli.topic.observing import observing
from cogmap.bus.discovery import discover
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import NoRouterError
from cogmap.runtime.inbox import Inbox
from cogmap.runtime.intake import Intake
from schemas import topics
from schemas.process import Clock, Health
from services import registry

LOOK_S = 3.3
RUNS = Path("runs")


@click.command()
@json_option
@connect_option
@agent_option
def doctor(as_json: bool, connect: str, agent: str) -> None:
    """Say what is wrong, and what to do about it; exit code 1 where anything is."""
    found = [*installation.examine(RUNS), *_running(connect, agent)]
    if as_json:
        click.echo(json.dumps([msgspec.to_builtins(finding) for finding in found]))
    else:
        click.echo(
            "\n".join(map(str, found))
            or "all is well, with the installation and with the system that runs"
        )
    sys.exit(1 if found else 0)


def _running(connect: str, agent: str) -> list[Finding]:
    try:
        with observing(connect, agent, "doctor") as bus:
            observed = observe(bus, LOOK_S)
            return system.examine(registry.MODULES, observed, discover(bus.session, agent))
    except NoRouterError:
        return [
            Finding(
                "router",
                f"none answers at {connect}",
                "start one with `cogmap run`, or name it with --connect",
            )
        ]


def observe(bus: ZenohBus, duration_s: float) -> Observed:
    """Listen for so long to who is there and how they fare."""
    observed = Observed()
    inbox = Inbox()
    intake = Intake()

    def on_change(member: Member, alive: bool) -> None:
        inbox.call(lambda: (observed.ready.add if alive else observed.ready.discard)(member))

    bus.watch(on_change)
    for topic in (topics.HEALTH, topics.CLOCK):
        bus.subscribe(topic, inbox.put, intake.count_lost)
    end_s = time.monotonic() + duration_s
    while (left_s := end_s - time.monotonic()) > 0:
        item = inbox.take(left_s)
        if isinstance(item, Arrival):
            match intake.accept(item):
                case Health() as health:
                    observed.health.setdefault(health.instance, []).append(health)
                case Clock() as clock:
                    observed.clock_rate = clock.rate
        elif item is not None:
            item()
    return observed
