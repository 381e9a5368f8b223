"""How many messages of a topic a publisher keeps in memory for subscribers that missed them."""

from __future__ import annotations

from dataclasses import dataclass

from cogmap.schemas import topics
from cogmap.schemas.topics import Topic

KEPT_S = 330.0
"""How long a subscriber may be away and still get everything: five minutes, and time to connect."""

CACHE_BYTES = 2 * 2**20
"""About the most that the cache of one topic takes. All of it travels at once to who missed it."""


@dataclass(frozen=True)
class Flow:
    """How often a topic carries a message, and the mean size of one with its envelope."""

    rate_hz: float
    size_bytes: int


# What a camera drive and a percept-level drive of the demo's towns had at most, at five views a
# second; of what is replayed and stored, on laps of 386 m. A topic that is not here carries a few
# small messages a view.
_USUAL = Flow(5.0, 1024)
_FLOWS = {
    topics.PERCEPTS: Flow(5.0, 6500),
    topics.LEARNED: Flow(5.0, 2500),
    topics.TASK: Flow(37.0, 2000),
    topics.LEASES: Flow(18.0, 400),
    topics.PROPOSAL: Flow(37.0, 5500),
    topics.OFFER: Flow(10.0, 400),
    topics.DELTA: Flow(23.0, 8500),
    topics.COALITIONS: Flow(5.0, 5500),
    topics.BROADCAST: Flow(5.0, 4500),
    topics.REPLAY: Flow(0.2, 88_000),
    topics.ROUTE_REPLAY: Flow(0.2, 1000),
    topics.STORED: Flow(0.2, 105_000),
    topics.TRUE_TOWN: Flow(0.2, 14_000),
    topics.MOTOR_PROGRAM: Flow(0.2, 300),
    topics.BEHAVIOURS: Flow(5.0, 1500),
    topics.ACTION: Flow(5.0, 1500),
}


def flow_of(topic: Topic) -> Flow:
    """Return how much `topic` carries in a usual drive."""
    if topic in _FLOWS:
        return _FLOWS[topic]
    return Flow(topic.rate_hz or _USUAL.rate_hz, _USUAL.size_bytes)


def cached_messages(topic: Topic) -> int:
    """Return how many messages of `topic` a publisher keeps in memory: those of KEPT_S, or as many
    as fit into CACHE_BYTES.
    """
    flow = flow_of(topic)
    in_time = flow.rate_hz * KEPT_S
    in_room = CACHE_BYTES / flow.size_bytes
    return max(1, int(min(in_time, in_room)))
