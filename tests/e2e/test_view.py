"""A running system in the viewers of other projects: real processes over Zenoh."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import aiohttp
import pytest

from cogmap.bus.session import free_endpoint
from tests.support.system.runs import COGMAP, DRIVING, TIMEOUT_S, Run, answered, wait_until

PERCEPTS = (
    "--lockstep",
    *("--town", "blocks"),
    *("--set", "sim.sensing=percepts"),
    *("--set", "sim.town_size_m=120"),
)
ADDRESS = re.compile(r"ws://\S+")
SUBPROTOCOL = "foxglove.sdk.v1"
DATA = 1


async def watched(address: str, wanted: set[str]) -> set[str]:
    """Subscribe to every channel of a server, until of all `wanted` topics a message has come.
    Returns the topics of which one has.
    """
    topics: dict[int, str] = {}
    received: set[str] = set()
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(address, protocols=[SUBPROTOCOL]) as socket,
    ):
        assert socket.protocol == SUBPROTOCOL
        while not wanted <= received:
            message = await socket.receive(TIMEOUT_S)
            if message.type is aiohttp.WSMsgType.BINARY:
                assert message.data[0] == DATA
                received.add(topics[int.from_bytes(message.data[1:5], "little")])
                continue

            said = json.loads(message.data)
            if said["op"] != "advertise":
                continue
            channels = said["channels"]
            topics |= {channel["id"]: channel["topic"] for channel in channels}
            wishes = [{"id": each["id"], "channelId": each["id"]} for each in channels]
            await socket.send_json({"op": "subscribe", "subscriptions": wishes})
    return received


def test_foxglove_sees_a_drive_as_it_goes_on(start: Callable[..., Run], tmp_path: Path) -> None:
    run = start(*PERCEPTS)
    run.wait_for(DRIVING)
    output = tmp_path / "view.txt"
    with output.open("w") as file:
        view = subprocess.Popen(
            [*COGMAP, "view", "foxglove", "--port", "0", "--connect", run.endpoint],
            stdout=file,
            stderr=subprocess.STDOUT,
        )
    try:
        wait_until(lambda: ADDRESS.search(output.read_text()) is not None, "it serves")
        address = ADDRESS.search(output.read_text())
        assert address is not None
        asyncio.run(watched(address[0], {"/pose", "/tf", "/objects", "/places", "/truth"}))
    finally:
        view.send_signal(signal.SIGINT)
        assert view.wait(TIMEOUT_S) == 0
    assert "0 rejected, 0 lost" in output.read_text()
    run.close()


@pytest.mark.parametrize("viewer", ["foxglove", "rerun"])
def test_where_nothing_runs_the_remedy_is_said(viewer: str) -> None:
    if viewer == "rerun":
        pytest.importorskip("rerun")
    refused = answered("view", free_endpoint(), viewer)

    assert refused.returncode == 2
    assert "cogmap run" in refused.stderr
