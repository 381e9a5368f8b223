"""`cogmap doctor`: finds problems of this installation and of the running system."""

from __future__ import annotations

import json
import sys
import time

import click
import msgspec
import psutil

from cogmap.bus.access.certificates import now_utc
from cogmap.bus.discovery import discover
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.doctor import installation, keys, system
from cogmap.cli.doctor.finding import Finding
from cogmap.cli.doctor.observed import Observed
from cogmap.cli.options import json_option
from cogmap.cli.run.folder import RUNS
from cogmap.cli.topic.observing import observing
from cogmap.errors import AccessError, NoRouterError
from cogmap.runtime import environment
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.services import registry

OBSERVE_S = 3.3
"""Three reports of health a process, which come once a second, and a margin."""


@click.command()
@json_option
@connect_option
@agent_option
def doctor(as_json: bool, connect: str, agent: str) -> None:
    """Find problems of the installation and the running system, and say how to solve them.

    Ends with 1 if there is a problem.
    """
    findings = installation.examine(RUNS)
    folder = environment.keys_folder()
    if folder is not None:
        findings += keys.examine(folder, now_utc())
    try:
        with observing(connect, agent, "doctor") as bus:
            observed = observe(bus, OBSERVE_S)
            present = {member.module for member in observed.ready}
            is_recorded = registry.PLAYER in present and registry.SIM not in present
            expected = registry.taking_part(registry.PLAYER if is_recorded else registry.SIM)
            findings += system.examine(expected, observed, discover(bus.session, agent))
    except NoRouterError:
        remedy = "start one with `cogmap run`, or name it with --connect"
        findings.append(Finding("router", f"none answers at {connect}", remedy))
    except AccessError as error:
        findings.append(keys.refused(error))

    if as_json:
        click.echo(json.dumps([msgspec.to_builtins(finding) for finding in findings]))
    elif findings:
        click.echo("\n".join(map(str, findings)))
    else:
        click.echo("nothing is wrong with the installation or the running system")
    sys.exit(1 if findings else 0)


def observe(bus: ZenohBus, duration_s: float) -> Observed:
    """Collect what the processes report about themselves within `duration_s`."""
    observed = Observed()
    inbox = Inbox()
    intake = Intake()

    def on_change(member: Member, alive: bool) -> None:
        inbox.call(lambda: observed.note(member, alive))

    psutil.cpu_percent()  # from here on the next call measures
    bus.watch(on_change)
    for topic in (topics.HEALTH, topics.CLOCK, topics.PAUSED, topics.MOTOR_COMMAND):
        bus.subscribe(topic, inbox.put, intake.count_lost)

    end_s = time.monotonic() + duration_s
    while (left_s := end_s - time.monotonic()) > 0:
        item = inbox.take(left_s)
        if isinstance(item, Arrival):
            observed.add(intake.accept(item))
        elif item is not None:
            item()
    observed.busy = psutil.cpu_percent() / 100
    return observed
