"""Serves the page of the dashboard: its files, what is new of each part, wishes."""

from __future__ import annotations

import asyncio
import ipaddress
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
from aiohttp import WSMsgType, web

from cogmap.cli.dashboard.pace import Pace
from cogmap.cli.dashboard.parts import ASKED_FOR, PartName
from cogmap.cli.dashboard.scene import Scene
from cogmap.cli.dashboard.source import Source, Wish
from cogmap.errors import CogmapError
from cogmap.schemas import topics
from cogmap.schemas.render import to_text

PAGE = Path(__file__).parent / "page"
PERIOD_S = 0.1
"""A browser is told what is new at most so often, and never before it has shown the last."""

LOOK_S = 0.01
LONGEST_WAIT_S = 0.5
"""A browser that asks waits so long at most."""

MADE_ANEW_S = {
    PartName.MAP: 0.5,
    PartName.PLACES: 0.5,
    PartName.COSTS: 1.0,
    PartName.CUTS: 1.0,
    PartName.DEPTH: 0.5,
    PartName.MIND: 0.5,
    PartName.SYSTEM: 0.5,
    PartName.TOPICS: 0.5,
    PartName.TRUTH: 1.0,
}
"""How often a part is made anew at most: what changes slowly costs little."""

ALWAYS = frozenset(PartName) - ASKED_FOR

MAX_REQUEST_BYTES = 64 * 1024
MAX_TEXT = 20_000
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Asked(msgspec.Struct, kw_only=True):
    """What a browser asks for: what is newer than what it has, also of the parts `also`, which are
    of ASKED_FOR, and a message of `topic`.
    """

    have: dict[PartName, int] = {}
    also: frozenset[PartName] = frozenset()
    topic: str = ""


@dataclass(frozen=True)
class Made:
    """A part as it was made last, of `scene`."""

    scene: Scene
    version: int
    content: msgspec.Raw
    made_s: float


class Dashboard:
    """The dashboard of `source`, for browsers that reach it by an address, as localhost, or by the
    name `host`.
    """

    def __init__(self, source: Source, host: str) -> None:
        self._source = source
        self._names = {"localhost", host}
        self._made: dict[PartName, Made] = {}
        self._pace = Pace()
        self._browsers = 0

    def application(self) -> web.Application:
        """Return what is to be served."""
        guards = [self._only_for_own_page]
        app = web.Application(middlewares=guards, client_max_size=MAX_REQUEST_BYTES)
        app.add_routes(
            [
                web.get("/", _index),
                web.get("/news", self._news),
                web.post("/wish", self._wish),
                web.static("/page", PAGE),
            ]
        )
        return app

    @web.middleware
    async def _only_for_own_page(
        self, request: web.Request, handler: Handler
    ) -> web.StreamResponse:
        """Refuse what another site's page asks for in the name of whoever looks at it, also where
        that site's name leads here.
        """
        name = request.url.host or ""
        origin = request.headers.get("Origin", f"http://{request.host}")
        if origin != f"http://{request.host}" or not (name in self._names or _is_address(name)):
            raise web.HTTPForbidden(text="This is a dashboard for its own page alone.")
        response = await handler(request)
        if not response.prepared:
            response.headers.update(HEADERS)
        return response

    async def _news(self, request: web.Request) -> web.WebSocketResponse:
        """Answer each request of a browser once something is new for it."""
        socket = web.WebSocketResponse(heartbeat=20.0, max_msg_size=MAX_REQUEST_BYTES)
        await socket.prepare(request)
        self._browsers += 1
        self._source.watched(self._browsers)
        try:
            async for received in socket:
                if received.type is not WSMsgType.TEXT:
                    break
                asked = msgspec.json.decode(received.data, type=Asked)
                began_s = time.monotonic()
                await socket.send_bytes(await self._newer(asked))
                await asyncio.sleep(max(0.0, began_s + PERIOD_S - time.monotonic()))
        except (msgspec.MsgspecError, ConnectionError):
            pass  # it went away, or is no page of ours
        finally:
            self._browsers -= 1
            self._source.watched(self._browsers)
        return socket

    async def _newer(self, asked: Asked) -> bytes:
        """Wait until something is worth telling a browser, and return all parts that are newer than
        what it has.
        """
        view = self._source.scene.versions[PartName.CAMERA]
        waited_s = 0.0
        while waited_s < LONGEST_WAIT_S and not self._is_worth_telling(asked, view):
            await asyncio.sleep(LOOK_S)
            waited_s += LOOK_S
        playing = self._source.playing
        found = await asyncio.to_thread(self._parts, asked)

        news = {
            "label": self._source.label,
            "is_there": self._source.is_there,
            "playing": playing,
            "rest_ms": 0.0 if playing is not None else self._pace.rest_ms(),
            "parts": {name: {"version": m.version, "content": m.content} for name, m in found},
            "message": self._message(asked.topic),
        }
        return msgspec.json.encode(news)

    def _is_worth_telling(self, asked: Asked, view: int) -> bool:
        """Decide whether there is a newer view than the version `view`, which an image of now
        waits for; in a log that stands, whether there is anything new.
        """
        versions = self._source.scene.versions
        playing = self._source.playing
        if playing is None or playing.is_playing:
            return versions[PartName.CAMERA] != view
        return any(versions[name] != asked.have.get(name) for name in ALWAYS | asked.also)

    def _parts(self, asked: Asked) -> list[tuple[PartName, Made]]:
        """Make what is newer than what a browser has, and not made too short a time ago."""
        found = []
        for name in ALWAYS | asked.also:
            made = self._made.get(name)
            if made is None or self._is_due(name, made):
                made = self._made[name] = self._make(name)
            if made.version != asked.have.get(name):
                found.append((name, made))
        return found

    def _is_due(self, name: PartName, made: Made) -> bool:
        """Decide whether a part is to be made anew: of another moment of a log at once."""
        scene = self._source.scene
        if made.scene is not scene:
            return True

        age_s = time.monotonic() - made.made_s
        return made.version != scene.versions[name] and age_s >= MADE_ANEW_S.get(name, 0.0)

    def _make(self, name: PartName) -> Made:
        with self._source.lock:
            scene = self._source.scene
            version = scene.versions[name]
            part = scene.part(name)
        content = msgspec.Raw(msgspec.json.encode(part))
        return Made(scene, version, content, time.monotonic())

    def _message(self, name: str) -> dict[str, str] | None:
        """Return the newest message of a topic as text; None if there is none."""
        topic = topics.BY_NAME.get(name)
        message = None if topic is None else self._source.scene.received.message(topic)
        if message is None:
            return None
        return {"topic": name, "text": to_text(message)[:MAX_TEXT]}

    async def _wish(self, request: web.Request) -> web.Response:
        """Do what a person wishes, and say what was done, or why not."""
        if request.content_type != "application/json":
            raise web.HTTPUnsupportedMediaType(text="A wish is JSON.")
        try:
            wish = msgspec.json.decode(await request.read(), type=Wish)
            done = await asyncio.to_thread(self._source.act, wish)
        except (msgspec.MsgspecError, CogmapError) as error:
            return web.Response(status=400, text=str(error))
        return web.Response(text=done)


def _is_address(name: str) -> bool:
    """Return whether a host is given by its address: no other site's name leads to it."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


async def _index(_request: web.Request) -> web.FileResponse:
    return web.FileResponse(PAGE / "index.html")
