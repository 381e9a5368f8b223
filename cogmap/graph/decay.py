"""Linear decay, computed when it is asked for: what is kept is a value and the cycle of its
writing, so that a cycle costs nothing for what did not change in it.
"""

from __future__ import annotations

from bisect import bisect_left

from schemas.graph import Decay
from schemas.nodes import KINDS, GraphNode

NEVER = 2**62
_LONGEST = 2**40


def activation(node: GraphNode, cycle: int, decay: Decay) -> float:
    """A node's activation in `cycle`."""
    if KINDS[type(node)].persistent:
        return node.activation
    return max(0.0, node.activation - decay.activation * max(0, cycle - node.cycle))


def base_level(node: GraphNode, cycle: int, decay: Decay) -> float:
    """A node's base-level activation in `cycle`."""
    if KINDS[type(node)].persistent:
        return node.base_level
    return max(0.0, node.base_level - decay.base_level * max(0, cycle - node.cycle))


def total_activation(node: GraphNode, cycle: int, decay: Decay) -> float:
    """min(1, base-level + current), LIDA's total activation, in `cycle`."""
    return min(1.0, activation(node, cycle, decay) + base_level(node, cycle, decay))


def cycle_of_forgetting(node: GraphNode, decay: Decay) -> int:
    """The cycle at whose end a node is forgotten: in the next it would be below threshold.

    NEVER for a node that stays.
    """
    rules = KINDS[type(node)]
    if rules.persistent or not rules.droppable or decay.forget_below <= 0:
        return NEVER

    def is_below(age: int) -> bool:
        return total_activation(node, node.cycle + age, decay) < decay.forget_below

    age = bisect_left(range(_LONGEST), True, lo=1, key=is_below)
    return NEVER if age == _LONGEST else node.cycle + age - 1
