"""In lockstep the graph is the same to the byte whatever strangers put on the topics between the
messages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from cogmap.bus.session import open_client
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.sensing import Percepts, SelfMotion
from cogmap.schemas.topics import Delivery
from cogmap.testing import percept
from tests.support.damage import damaged
from tests.support.system.live import Witness
from tests.support.system.networks import working
from tests.support.system.processes import AGENT, System, wait_until

TRAVELLING = [topic for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST]
VIEWS = len(TRAVELLING)
PERIOD_NS = 200_000_000
MOTIONS = Array.of(np.array([[2.0, 0.0, 0.2, 0.1, 0.01]]))
ROAD_M = Array.of(np.array([[3.0, 0.0], [4.0, 1.0]], np.float32))


class Turns:
    """Stands in for body and perception: the next view comes when the cycle of the last one has
    ended.
    """

    def __init__(self, before: Callable[[int], None]) -> None:
        self._views = 0
        self._before = before
        emits = (topics.SELF_MOTION, topics.PERCEPTS)
        requires = {"workspace": 1, "codelets": 2, "witness": 1}
        self.module = Module("turns")
        self.module.on(topics.DELTA, self._on_delta, emits)
        self.module.on_start(self._view, requires, emits)

    def _on_delta(self, delta: Delta) -> list[Message]:
        has_ended = delta.phase is Phase.END
        return self._view() if has_ended and self._views < VIEWS else []

    def _view(self) -> list[Message]:
        self._before(self._views)
        since_ns = self._views * PERIOD_NS
        self._views += 1

        frame = self._views
        stamp_ns = frame * PERIOD_NS
        house = percept("building-01", 0.3, 40.0 - 0.4 * frame)
        motion = SelfMotion(stamp_ns=stamp_ns, frame=frame, since_ns=since_ns, motions=MOTIONS)
        percepts = Percepts(stamp_ns=stamp_ns, frame=frame, objects=[house], road_m=ROAD_M)
        return [motion, percepts]


@pytest.fixture
def other(tmp_path: Path) -> Iterator[System]:
    """A system like the fixture `system`, beside it."""
    (tmp_path / "other").mkdir()
    other = System(tmp_path / "other")
    yield other
    other.close()


def drive(system: System, before: Callable[[int], None] = lambda view: None) -> Witness:
    """The witness of all views."""
    system.modules("workspace", "codelets-1", "codelets-2", settings=("run.lockstep=true",))
    witness = Witness(system.bus())
    turns = Turns(before)

    def all_have_ended() -> bool:
        return witness.graph.cycle == VIEWS and witness.deltas[-1].phase is Phase.END

    with working(witness.shell), working(Shell(turns.module, system.bus())):
        wait_until(all_have_ended, "the cycles of all views end")
    return witness


def test_what_is_no_message_changes_no_byte_of_the_graph(system: System, other: System) -> None:
    system.router()
    other.router()
    stranger = open_client(other.endpoint)

    def molest(view: int) -> None:
        topic = TRAVELLING[view]
        for payload in damaged(topic).values():
            stranger.put(topic.key(AGENT), payload, attachment=b"no envelope")

    left_alone = drive(system)
    molested = drive(other, molest)
    stranger.close()  # type: ignore[no-untyped-call]

    assert molested.graph.digest() == left_alone.graph.digest()
    assert molested.versions == left_alone.versions
    assert not molested.shell.intake.gaps
