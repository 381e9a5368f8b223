"""Conscious learning: the base level of what was broadcast rises (LIDA's framework).

What was broadcast as missing, a surprise with a salience below 0, is unlearned instead.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec

from cogmap.graph import decay
from cogmap.graph.graph import Graph
from cogmap.schemas.cognition import Broadcast, Coalition
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import KINDS, AnyNode, Attention, attention_id
from cogmap.services.workspace.config import Config

# The sigmoid rises as fast as the line in its middle.
STEEPNESS = 4.0
MIN_LEVEL = 1e-3


def learned_operations(
    broadcasts: Iterable[Broadcast], graph: Graph, cycle: int, config: Config
) -> list[Operation]:
    """The nodes of `broadcasts` that `graph` still has, as of `cycle`, with their new base levels,
    and the attention codelets that keep something, with the cycle in which they were conscious.
    """
    learned: dict[str, AnyNode] = {}
    for broadcast in broadcasts:
        is_surprise = broadcast.coalition.feeling is Feeling.SURPRISE
        for told in broadcast.coalition.nodes:
            missing = -min(0.0, told.salience) if is_surprise else 0.0
            node = learned.get(told.id) or graph.nodes.get(told.id)
            if node is not None and not KINDS[type(node)].persistent:
                learned[node.id] = _learned(node, missing, graph, cycle, config)

        memory = _reinforced(broadcast, broadcast.coalition, graph)
        if memory is not None:
            learned[memory.id] = memory

    return [learned[name] for name in sorted(learned)]


def risen(level: float, config: Config) -> float:
    """A base level after one broadcast more, by a line or a sigmoid."""
    if config.learning == "linear":
        return min(1.0, level + config.learning_rate)

    bounded = min(1 - MIN_LEVEL, max(MIN_LEVEL, level))
    excitation = math.log(bounded / (1 - bounded)) + STEEPNESS * config.learning_rate
    return max(level, 1 / (1 + math.exp(-excitation)))


def _learned(node: AnyNode, missing: float, graph: Graph, cycle: int, config: Config) -> AnyNode:
    """A node as of `cycle`, after a broadcast of it: as `missing`, 0 to 1, where it is above 0."""
    level = decay.base_level(node, cycle, graph.decay)
    if missing > 0:
        after = max(0.0, level - config.unlearning_rate * missing)
    else:
        after = risen(level, config)

    return msgspec.structs.replace(
        node,
        activation=decay.activation(node, cycle, graph.decay),
        base_level=after,
        cycle=cycle,
    )


def _reinforced(broadcast: Broadcast, won: Coalition, graph: Graph) -> Attention | None:
    """What the codelet of a coalition keeps, after its broadcast; None where it keeps nothing."""
    memory = graph.get(Attention, attention_id(won.codelet))
    if memory is None:
        return None

    return msgspec.structs.replace(memory, conscious_cycle=broadcast.cycle)
