"""Linear decay, computed on demand: a node keeps a value and the cycle in which it was written, so
that a cycle costs nothing for nodes that it does not change.
"""

from __future__ import annotations

from bisect import bisect_left

from cogmap.schemas.graph import Decay
from cogmap.schemas.nodes import KINDS, GraphNode

# Later than any cycle, and longer than any node lives.
NEVER = 2**62
_MAX_AGE = 2**40


def activation(node: GraphNode, cycle: int, decay: Decay) -> float:
    """Return a node's activation in `cycle`."""
    if KINDS[type(node)].persistent:
        return node.activation

    age = max(0, cycle - node.cycle)
    return max(0.0, node.activation - decay.activation * age)


def base_level(node: GraphNode, cycle: int, decay: Decay) -> float:
    """Return a node's base-level activation in `cycle`. Once it has reached the level that is kept,
    it never decays below that.
    """
    if KINDS[type(node)].persistent:
        return node.base_level

    age = max(0, cycle - node.cycle)
    is_kept = node.base_level >= decay.kept_base_level
    lowest = decay.kept_base_level if is_kept else 0.0
    return max(lowest, node.base_level - decay.base_level * age)


def total_activation(node: GraphNode, cycle: int, decay: Decay) -> float:
    """Return min(1, base-level + current), LIDA's total activation, in `cycle`."""
    current = activation(node, cycle, decay)
    base = base_level(node, cycle, decay)
    return min(1.0, current + base)


def cycle_of_forgetting(node: GraphNode, decay: Decay) -> int:
    """Return the cycle at whose end a node is forgotten: in the next it would be below threshold.

    NEVER for a node that stays.
    """
    rules = KINDS[type(node)]
    if rules.persistent or not rules.droppable or decay.forget_below <= 0:
        return NEVER

    def is_below(age: int) -> bool:
        total = total_activation(node, node.cycle + age, decay)
        return total < decay.forget_below

    # Most are forgotten soon.
    beyond = 2
    while not is_below(beyond):
        if beyond == _MAX_AGE:
            return NEVER
        beyond *= 2

    age = bisect_left(range(_MAX_AGE), True, lo=beyond // 2, hi=beyond, key=is_below)
    return node.cycle + age - 1
