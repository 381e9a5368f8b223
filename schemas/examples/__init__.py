"""One message of every type, always the same: what the golden bytes are made of."""

from __future__ import annotations

import msgspec

from cogmap.schemas.base import Message
from cogmap.schemas.examples import codelets, cognition, graph, memory, process, sensing

_STAMP_NS = 1_200_000_000


def example_messages() -> list[Message]:
    """A message of every type in the table of topics, every field of it other than its default.

    A new one goes last: `seq` is its place in the list.
    """
    messages = [
        *sensing.messages(),
        codelets.proposal(),
        *graph.messages(),
        *codelets.messages(),
        *cognition.messages(),
        *process.messages(),
        sensing.learned(),
        cognition.replay(),
        sensing.street_closure(),
        cognition.route_replay(),
        memory.stored(),
        memory.restored(),
        sensing.energy(),
    ]
    stamped: list[Message] = []
    for seq, message in enumerate(messages):
        stamped.append(
            msgspec.structs.replace(message, stamp_ns=_STAMP_NS, seq=seq, source="sample")
        )
    return stamped
