"""Time that a person lets stand, of a running system: real processes over Zenoh."""

from __future__ import annotations

from collections.abc import Callable

from cogmap.bus.codec import decode
from cogmap.bus.interface import Arrival
from cogmap.bus.session import free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.schemas import topics
from cogmap.schemas.sensing import Percepts
from tests.support.system.processes import wait_until
from tests.support.system.runs import DRIVING, Run, answered

PERCEPTS = (
    "--lockstep",
    *("--town", "blocks"),
    *("--set", "sim.sensing=percepts"),
    *("--set", "sim.town_size_m=120"),
)


def test_a_drive_stands_goes_on_by_views_and_from_its_start_and_goes_on(
    start: Callable[..., Run],
) -> None:
    run = start(*PERCEPTS)
    run.wait_for(DRIVING)
    frames: list[int] = []

    def receive(arrival: Arrival) -> None:
        message = decode(topics.PERCEPTS, arrival.payload)
        assert isinstance(message, Percepts)
        frames.append(message.frame)

    bus = ZenohBus(run.endpoint, "agent")
    bus.subscribe(topics.PERCEPTS, receive, lambda _topic, _number: None)

    assert "time stands" in answered("time", run.endpoint, "pause").stdout
    assert "so often by now: 1" in answered("time", run.endpoint, "reset").stdout
    before = len(frames)
    assert "views to come: 3" in answered("time", run.endpoint, "step", "3").stdout
    wait_until(lambda: len(frames) == before + 3, "three views have come")
    assert "time passes" in answered("time", run.endpoint, "resume").stdout
    wait_until(lambda: len(frames) > before + 10, "views come again")
    assert "so often by now: " in answered("time", run.endpoint, "reset").stdout
    bus.close()
    run.close()


def test_where_nothing_runs_the_remedy_is_said() -> None:
    refused = answered("time", free_endpoint(), "pause")

    assert refused.returncode == 2
    assert "cogmap run" in refused.stderr
