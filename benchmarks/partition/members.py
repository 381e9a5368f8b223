"""Who publishes and who receives over a bad link, with the product's own shells."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from benchmarks.bus.deltas import typical_operations
from cogmap.bus.codec import decode
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.outbox import Outbox
from cogmap.runtime.state.published import PublishedCounts
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.sensing import Odometry

AGENT = "partition"
ODOMETRY_NS = 50_000_000
DELTA_NS = 100_000_000
RECEIVER = "receiver"
SPUN_S = 0.01
CARRIED = (topics.ODOMETRY, topics.DELTA)


class Source:
    """Publishes odometry 20 times a second, and a delta of some 30 KB 10 times: once `receivers`
    are there, and until it is stopped. It keeps in `folder` what a module keeps.
    """

    def __init__(self, name: str, endpoint: str, folder: Path, receivers: int) -> None:
        self.name = name
        self.is_publishing = False
        self._version = 0
        self._operations = typical_operations()
        module = Module(name).on_start(self._start, {RECEIVER: receivers})
        module.every(ODOMETRY_NS, self._on_odometry, [topics.ODOMETRY])
        module.every(DELTA_NS, self._on_delta, [topics.DELTA])
        self.shell = Shell(
            module,
            ZenohBus(endpoint, AGENT),
            health=False,
            counts=PublishedCounts(folder / f"{name}.published"),
            outbox=Outbox(folder / f"{name}.outbox"),
        )

    @property
    def published(self) -> Counter[str]:
        """Return how many messages it has published, by topic."""
        return self.shell.publisher.emitted

    def _start(self) -> None:
        self.is_publishing = True

    def _on_odometry(self, now_ns: int) -> Message | None:
        if not self.is_publishing:
            return None
        return Odometry(stamp_ns=now_ns, dt_s=ODOMETRY_NS / 1e9, speed_m_s=1.0, turn_rate_rad_s=0.0)

    def _on_delta(self, now_ns: int) -> Message | None:
        if not self.is_publishing:
            return None
        self._version += 1
        return Delta(
            stamp_ns=now_ns,
            version=self._version,
            cycle=self._version,
            phase=Phase.OBJECTS,
            operations=self._operations,
        )


class Receiver:
    """Counts the messages of each source on each topic."""

    def __init__(self, name: str, endpoint: str) -> None:
        self.received: Counter[tuple[str, str]] = Counter()
        module = Module(RECEIVER, name)
        for topic in CARRIED:
            module.on(topic, self._note)
        self.shell = Shell(module, ZenohBus(endpoint, AGENT), health=False)

    def lacks(self, sources: list[Source]) -> int:
        """Return how many of their messages have not come."""
        lacking = 0
        for source in sources:
            for topic, number in source.published.items():
                lacking += number - self.received[source.name, topic]
        return lacking

    @property
    def reported(self) -> int:
        """Return how many messages it knows to be lost."""
        return self.shell.intake.gaps.total()

    def _note(self, message: Message) -> None:
        self.received[message.source, topics.of(message).name] += 1


@contextmanager
def working(*shells: Shell) -> Iterator[None]:
    """Run each shell on a thread of its own."""
    ended = threading.Event()
    # Two threads that make the decoder of one type at once end the process (msgspec 0.22).
    for topic in CARRIED:
        with suppress(MessageError):
            decode(topic, b"")

    def work(shell: Shell) -> None:
        while not ended.is_set():
            shell.spin_once(SPUN_S)

    with ExitStack() as stack:
        for shell in shells:
            shell.open()
            stack.callback(shell.close)
        for shell in shells:
            thread = threading.Thread(target=work, args=(shell,), daemon=True)
            thread.start()
            stack.callback(thread.join)
        stack.callback(ended.set)
        yield
