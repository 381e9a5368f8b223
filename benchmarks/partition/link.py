"""A bad link between one process and the router: late, halting, narrow, or gone for a while."""

from __future__ import annotations

import asyncio
import random
import threading
from collections.abc import Coroutine
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from cogmap.bus.session import free_port

CHUNK_BYTES = 16 * 1024
# How long a chunk that is lost holds up those after it: TCP's shortest time to send it again.
STALL_S = 0.2
WAIT_S = 10.0


@dataclass(frozen=True)
class Quality:
    """How a link treats each chunk: how late it is, the share of those that hold up the others, and
    how many bytes it carries a second.
    """

    delay_s: float = 0.0
    stall_share: float = 0.0
    rate_bytes_s: float = float("inf")


class Link:
    """Carries what connects to `endpoint` to the port `router_port` of this machine, on a thread of
    its own. The same `seed` halts at the same chunks.
    """

    def __init__(self, router_port: int, quality: Quality, seed: int) -> None:
        self.quality = quality
        self._router_port = router_port
        self._random = random.Random(seed)
        self._port = free_port()
        self._pumps: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self.open()

    @property
    def endpoint(self) -> str:
        """Return where to connect."""
        return f"tcp/127.0.0.1:{self._port}"

    def open(self) -> None:
        """Let processes connect."""
        self._run(self._open())

    def cut(self) -> None:
        """Break all connections, and refuse others until it is opened again."""
        self._run(self._cut())

    def close(self) -> None:
        """Cut the link for good."""
        self.cut()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(WAIT_S)

    async def _open(self) -> None:
        self._server = await asyncio.start_server(self._connect, "127.0.0.1", self._port)

    async def _cut(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        for pump in self._pumps:
            pump.cancel()
        await asyncio.gather(*self._pumps, return_exceptions=True)

    async def _connect(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            router = await asyncio.open_connection("127.0.0.1", self._router_port)
        except OSError:
            writer.close()
            return
        for source, sink in ((reader, router[1]), (router[0], writer)):
            pump = asyncio.create_task(self._pump(source, sink))
            self._pumps.add(pump)
            pump.add_done_callback(self._pumps.discard)

    async def _pump(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
        """Carry one direction until an end closes. What is under way at a time is bounded."""
        under_way: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(maxsize=256)
        writing = asyncio.create_task(self._write(under_way, sink))
        free_s = self._loop.time()
        try:
            while data := await source.read(CHUNK_BYTES):
                now_s = self._loop.time()
                free_s = max(free_s, now_s) + len(data) / self.quality.rate_bytes_s
                if self._random.random() < self.quality.stall_share:
                    free_s += STALL_S
                await under_way.put((free_s + self.quality.delay_s, data))
        except OSError:
            pass
        finally:
            writing.cancel()
            sink.close()

    async def _write(
        self, under_way: asyncio.Queue[tuple[float, bytes]], sink: asyncio.StreamWriter
    ) -> None:
        with suppress(OSError):
            while True:
                due_s, data = await under_way.get()
                await asyncio.sleep(max(0.0, due_s - self._loop.time()))
                sink.write(data)
                await sink.drain()
