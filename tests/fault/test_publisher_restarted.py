"""A module dies while the router is away: what it published meanwhile arrives after its restart."""

from __future__ import annotations

import signal

from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.published import PublishedCounts
from cogmap.schemas import topics
from cogmap.schemas.sensing import Odometry
from tests.support.system.networks import working
from tests.support.system.processes import System, wait_until

WITHOUT_IMAGES = ("sim.egl=false", "sim.frame_hz=1")


def published(system: System) -> int:
    """How many odometry messages the simulator has published, as its file counts them."""
    path = system.folder / "state" / "sim.published"
    counts = PublishedCounts(path)
    number = counts.earlier(topics.ODOMETRY)
    counts.close()
    return number


def test_what_nobody_received_before_a_restart_arrives_after_it(system: System) -> None:
    received: list[Odometry] = []
    system.router()
    listener = Shell(Module("listener").on(topics.ODOMETRY, received.append), system.bus())

    with working(listener):
        system.modules("sim", settings=WITHOUT_IMAGES)
        wait_until(lambda: len(received) > 20, "odometry arrives")

        system.processes["router"].end(signal.SIGKILL)
        before = published(system)
        wait_until(lambda: published(system) > before + 20, "odometry is published and lost")
        system.processes["sim"].end(signal.SIGKILL)
        arrived = len(received)
        before_death = published(system)

        system.router()
        system.modules("sim", settings=WITHOUT_IMAGES)
        wait_until(lambda: len(received) > before_death + 20, "odometry arrives again")

    numbers = [message.seq for message in received]
    assert before_death > arrived + 20
    assert numbers[:before_death] == list(range(before_death))
    assert numbers[before_death:] == list(range(len(numbers) - before_death))
    assert not listener.intake.gaps
    assert not listener.intake.rejected
