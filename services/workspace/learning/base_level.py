"""Conscious learning: the base level of what was broadcast rises (LIDA's framework).

What was broadcast as missing, a surprise with a salience below 0, is unlearned instead.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from cogmap.graph import decay
from cogmap.graph.graph import Graph
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import KINDS, AnyNode, Attention, attention_id

LEARNING_RATE = 0.1
"""What a base level gains in a broadcast. Of five views a second with an object, half or more lead
to a broadcast about it; what is seen once, perhaps by mistake, is conscious once. LIDA has
published no rate that we know.
"""

UNLEARNING_RATE = 0.4
"""What the base level of a node that is broadcast as missing loses, times its salience. What was
known best is kept no longer then, and is forgotten at once when it is missing three times.
"""


def learned_operations(
    broadcasts: Iterable[Broadcast], graph: Graph, cycle: int
) -> list[Operation]:
    """Return the nodes of `broadcasts` that `graph` still has, as of `cycle`, with new base levels,
    and the attention codelets that keep something, with the cycle in which they were conscious.
    """
    learned: dict[str, AnyNode] = {}
    for broadcast in broadcasts:
        is_surprise = broadcast.coalition.feeling is Feeling.SURPRISE
        for conscious in broadcast.coalition.nodes:
            node = learned.get(conscious.id) or graph.nodes.get(conscious.id)
            if node is None or KINDS[type(node)].persistent:
                continue

            level = decay.base_level(node, cycle, graph.decay)
            missing = -min(0.0, conscious.salience) if is_surprise else 0.0
            if missing > 0:
                level = max(0.0, level - UNLEARNING_RATE * missing)
            else:
                level = min(1.0, level + LEARNING_RATE)
            learned[node.id] = msgspec.structs.replace(
                node,
                activation=decay.activation(node, cycle, graph.decay),
                base_level=level,
                cycle=cycle,
            )

        memory = graph.get(Attention, attention_id(broadcast.coalition.codelet))
        if memory is not None:
            kept = msgspec.structs.replace(memory, conscious_cycle=broadcast.cycle)
            learned[kept.id] = kept

    return [learned[name] for name in sorted(learned)]
