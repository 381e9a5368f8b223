"""The server of a dashboard, as browsers meet it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import msgspec
import pytest
from aiohttp.test_utils import TestClient, TestServer

from cogmap.cli.dashboard.parts import ASKED_FOR, PartName
from cogmap.cli.dashboard.playback import Playback
from cogmap.cli.dashboard.server import Dashboard
from cogmap.cli.dashboard.source import Wish
from tests.support.reference import REFERENCE
from tests.support.system.processes import wait_until

Client = TestClient[Any, Any]
Visit = Callable[[Client], Awaitable[Any]]


@pytest.fixture(scope="module")
def source() -> Iterator[Playback]:
    """The end of the reference drive."""
    playback = Playback(REFERENCE)
    wait_until(lambda: playback.playing.indexed_s >= playback.playing.duration_s, "all is read")
    playback.act(Wish(seek_s=playback.playing.duration_s))
    wait_until(lambda: playback.playing.at_s == playback.playing.duration_s, "the end is shown")
    yield playback
    playback.close()


def visited(source: Playback, visit: Visit) -> Any:
    """What a visit to the dashboard returns."""

    async def run() -> Any:
        async with TestClient(TestServer(Dashboard(source, "dashboard.test").application())) as it:
            return await visit(it)

    return asyncio.run(run())


async def news(client: Client, **asked: Any) -> dict[str, Any]:
    async with client.ws_connect("/news") as socket:
        await socket.send_json(asked)
        found: dict[str, Any] = msgspec.json.decode(await socket.receive_bytes(timeout=10))
        return found


def test_a_browser_gets_every_part_first(source: Playback) -> None:
    found = visited(source, news)

    assert set(found["parts"]) == set(PartName) - ASKED_FOR
    assert found["label"] == str(REFERENCE)
    assert found["playing"]["duration_s"] > 0.0
    assert found["message"] is None


def test_a_layer_that_it_shows_comes_too(source: Playback) -> None:
    found = visited(source, lambda client: news(client, also=["costs"]))

    assert set(found["parts"]) == set(PartName) - ASKED_FOR | {PartName.COSTS}


def test_then_only_what_is_newer(source: Playback) -> None:
    async def visit(client: Client) -> dict[str, Any]:
        first = await news(client)
        have = {name: part["version"] for name, part in first["parts"].items()}
        have["map"] -= 1
        return await news(client, have=have)

    found = visited(source, visit)

    assert list(found["parts"]) == ["map"]


def test_the_newest_message_of_a_topic_comes_as_text(source: Playback) -> None:
    found = visited(source, lambda client: news(client, topic="odometry"))

    assert found["message"]["topic"] == "odometry"
    assert "speed_m_s:" in found["message"]["text"]


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/", "html"),
        ("/page/main.js", "javascript"),
        ("/page/style.css", "css"),
    ],
)
def test_the_page_is_served(source: Playback, path: str, kind: str) -> None:
    async def visit(client: Client) -> tuple[int, str, str]:
        response = await client.get(path)
        policy = response.headers["Content-Security-Policy"]
        return response.status, response.content_type, policy

    status, content_type, policy = visited(source, visit)

    assert status == 200
    assert content_type.endswith(kind)
    assert "default-src 'self'" in policy


def test_a_wish_is_done_and_said(source: Playback) -> None:
    async def visit(client: Client) -> tuple[int, str]:
        response = await client.post("/wish", json={"speed": 2.0})
        return response.status, await response.text()

    assert visited(source, visit) == (200, "2 times as fast as it was")
    assert source.playing.speed == 2.0


@pytest.mark.parametrize("wish", [{"speeed": 2.0}, {"seek_s": "soon"}, {"goal": "bakery"}, [], {}])
def test_a_wish_without_sense_is_refused_with_a_sentence(source: Playback, wish: object) -> None:
    async def visit(client: Client) -> tuple[int, str]:
        response = await client.post("/wish", json=wish)
        return response.status, await response.text()

    status, sentence = visited(source, visit)

    assert status == 400
    assert sentence


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://evil.test"}, {"Host": "evil.test"}, {"Content-Type": "text/plain"}],
)
def test_another_sites_page_can_wish_nothing(source: Playback, headers: dict[str, str]) -> None:
    before = source.playing.speed

    async def visit(client: Client) -> int:
        sent = {"Content-Type": "application/json", **headers}
        response = await client.post("/wish", data=b'{"speed": 7.0}', headers=sent)
        return response.status

    assert visited(source, visit) in (403, 415)
    assert source.playing.speed == before


def test_its_own_name_is_served(source: Playback) -> None:
    async def visit(client: Client) -> int:
        response = await client.get("/", headers={"Host": "dashboard.test:8470"})
        return response.status

    assert visited(source, visit) == 200


def test_a_browser_that_says_nonsense_is_left_alone(source: Playback) -> None:
    async def visit(client: Client) -> dict[str, Any]:
        async with client.ws_connect("/news") as socket:
            await socket.send_str("nonsense")
            await socket.receive(timeout=10)
        return await news(client)

    assert visited(source, visit)["parts"]
