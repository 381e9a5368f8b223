"""What a viewer of another project is shown of a running system."""

from __future__ import annotations

import time

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.view.following import Following
from cogmap.errors import LogError
from cogmap.recording.exporting.moments import Map, Moment
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.nodes import Need, Self
from cogmap.testing import agent
from tests.support.logs import SECOND_NS, delta, scan

NEED = Need(id="need:energy", label="energy", level=0.25)


class System:
    """Publishes messages, and shows what there is to show of them."""

    def __init__(self) -> None:
        network = MemoryNetwork()
        self._bus = MemoryBus(network)
        self.following = Following(MemoryBus(network), (topics.SCAN,))

    def publish(self, message: Message, received_ns: int | None = None) -> None:
        at_ns = time.time_ns() if received_ns is None else received_ns
        envelope = Envelope(message.source, message.seq, 1, at_ns, at_ns)
        self._bus.publish(topics.of(message), encode(message), envelope)

    def shown(self) -> list[Moment]:
        """All that is to be shown of what was published."""
        moments: list[Moment] = []
        while self.following.show_next(0.0, moments.append):
            pass
        return moments


def test_senses_beliefs_and_the_map_are_shown() -> None:
    system = System()
    system.publish(scan(1))
    system.publish(delta(1, agent(), NEED))

    kinds = [type(each.content) for each in system.shown()]

    assert kinds[1:] == [Self, Need, Map]


def test_a_scan_has_the_time_at_which_it_was_received() -> None:
    system = System()
    system.publish(scan(1, stamp_ns=300 * SECOND_NS), received_ns=1000 * SECOND_NS)

    (moment,) = system.shown()

    assert moment.stamp_ns == moment.log_time_ns == 1000 * SECOND_NS


def test_what_cannot_be_shown_is_rejected() -> None:
    system = System()
    system.publish(scan(1))

    def refuse(_moment: Moment) -> None:
        raise LogError("the view's image: expected a uint8 image")

    assert system.following.show_next(0.0, refuse)
    assert "1 rejected" in system.following.counts()


def test_only_the_newest_of_scans_that_nobody_waited_for_is_shown() -> None:
    system = System()
    for number in range(3):
        system.publish(scan(number))

    (moment,) = system.shown()

    assert moment.content == scan(2)
    assert system.following.counts() == (
        "1 messages, 0 rejected, 0 lost, 2 superseded by newer ones"
    )
