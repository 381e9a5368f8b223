"""How a module waits for what comes."""

from __future__ import annotations

import threading

from cogmap.runtime.delivery.inbox import Inbox

SHORT_S = 2e-6
TIMES = 30_000


def test_a_wait_that_is_over_as_it_begins_ends() -> None:
    ended = threading.Event()

    def wait() -> None:
        for _ in range(TIMES):
            Inbox().take(SHORT_S)
        ended.set()

    threading.Thread(target=wait, daemon=True).start()

    assert ended.wait(30)
