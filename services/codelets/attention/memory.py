"""What an attention codelet keeps in the graph: its refractory period, and what it has still to
make conscious.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer
from cogmap.schemas.cognition import Coalition
from cogmap.schemas.nodes import Attention, attention_id


def memory_of(codelet: str, graph: Graph) -> Attention:
    """What `codelet` keeps; nothing at first."""
    identifier = attention_id(codelet)
    found = graph.get(Attention, identifier)
    if found is not None:
        return found

    return Attention(id=identifier, codelet=codelet, base_level=1.0)


def is_refractory(codelet: str, graph: Graph, cycle: int, refractory_cycles: int) -> bool:
    """Whether `codelet` has brought a coalition so lately that it waits in `cycle`."""
    brought = memory_of(codelet, graph).brought_cycle
    if not brought:
        return False
    return cycle - brought <= refractory_cycles


def without_conscious(memory: Attention) -> Attention:
    """`memory`, in which nothing is pending that was brought and broadcast since."""
    pending = {}
    for name, brought_cycle in memory.pending.items():
        was_broadcast = 0 < brought_cycle <= memory.conscious_cycle
        if not was_broadcast:
            pending[name] = brought_cycle

    return msgspec.structs.replace(memory, pending=pending)


def with_pending(memory: Attention, names: Iterable[str]) -> Attention:
    """`memory`, in which `names` are pending too."""
    added = dict.fromkeys(names, 0)
    return msgspec.structs.replace(memory, pending=memory.pending | added)


def brought(memory: Attention, found: Coalition, cycle: int, graph: Graph) -> Answer:
    """A coalition about all that is pending, and what the codelet keeps of it."""
    pending = dict.fromkeys(memory.pending, cycle)
    after = msgspec.structs.replace(memory, brought_cycle=cycle, pending=pending)
    return kept(after, graph, [found])


def kept(memory: Attention, graph: Graph, found: Iterable[Coalition] = ()) -> Answer:
    """Coalitions, and what the codelet keeps, where that is new."""
    answer = Answer(coalitions=list(found))
    if memory != graph.nodes.get(memory.id):
        answer.operations.append(memory)
    return answer
