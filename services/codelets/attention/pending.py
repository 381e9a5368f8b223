"""The state of an attention codelet in the graph: its refractory period, and content that is
pending until it is conscious.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer
from cogmap.schemas.cognition import Coalition
from cogmap.schemas.nodes import Attention, attention_id

# Cycles that a codelet waits after it has brought a coalition. LIDA's refractory period of 50
# ticks of 5 ms ends within the second cycle of 200 ms. It is counted in cycles, for attention
# codelets run once in each, so that a run depends on no clock.
REFRACTORY_CYCLES = 1


def memory_of(codelet: str, graph: Graph) -> Attention:
    """Return what `codelet` keeps; nothing at first."""
    identifier = attention_id(codelet)
    found = graph.get(Attention, identifier)
    if found is not None:
        return found

    return Attention(id=identifier, codelet=codelet, base_level=1.0)


def is_refractory(
    codelet: str, graph: Graph, cycle: int, refractory_cycles: int = REFRACTORY_CYCLES
) -> bool:
    """Return whether `codelet` brought a coalition so few cycles ago that it waits in `cycle`."""
    brought = memory_of(codelet, graph).brought_cycle
    return brought > 0 and cycle - brought <= refractory_cycles


def without_conscious(memory: Attention) -> Attention:
    """Drop from what is pending in `memory` all that was brought and has been broadcast since."""
    pending = {}
    for name, brought_cycle in memory.pending.items():
        was_broadcast = 0 < brought_cycle <= memory.conscious_cycle
        if not was_broadcast:
            pending[name] = brought_cycle

    return msgspec.structs.replace(memory, pending=pending)


def with_pending(memory: Attention, names: Iterable[str]) -> Attention:
    """Add `names` to what is pending in `memory`."""
    added = dict.fromkeys(names, 0)
    return msgspec.structs.replace(memory, pending=memory.pending | added)


def brought(memory: Attention, found: Coalition, cycle: int, graph: Graph) -> Answer:
    """Answer with a coalition about all that is pending, and what the codelet keeps of it."""
    pending = dict.fromkeys(memory.pending, cycle)
    after = msgspec.structs.replace(memory, brought_cycle=cycle, pending=pending)
    return kept(after, graph, [found])


def kept(memory: Attention, graph: Graph, found: Iterable[Coalition] = ()) -> Answer:
    """Answer with coalitions, and what the codelet keeps, if that is new."""
    answer = Answer(coalitions=list(found))
    if memory != graph.nodes.get(memory.id):
        answer.operations.append(memory)
    return answer
