"""The table of node kinds: the rules that hold for all nodes of a kind."""

from __future__ import annotations

from dataclasses import dataclass

from cogmap.schemas.nodes.attention import Attention, Need
from cogmap.schemas.nodes.base import GraphNode, Node
from cogmap.schemas.nodes.episode import Episode
from cogmap.schemas.nodes.path import Correction, LoopClosure, Observations, PathSegment
from cogmap.schemas.nodes.planning import Goal, Plan
from cogmap.schemas.nodes.recollection import Recollection
from cogmap.schemas.nodes.situation import Map, Object, Percept, Self

AnyNode = (
    Node
    | Self
    | Percept
    | Object
    | PathSegment
    | Observations
    | LoopClosure
    | Correction
    | Map
    | Goal
    | Plan
    | Recollection
    | Episode
    | Need
    | Attention
)


@dataclass(frozen=True)
class KindRules:
    """What holds for all nodes of a kind.

    Nodes that are `persistent` do not decay. All nodes of an `indexed` kind are found without a
    search. What `moves_with_path` is moved when the map is corrected. `offered` kinds may be
    written by an offer, all others by codelets alone. What is not `droppable` is never forgotten,
    and neither is the root map.
    """

    persistent: bool = False
    indexed: bool = False
    moves_with_path: bool = False
    offered: bool = False
    droppable: bool = True


KINDS: dict[type[GraphNode], KindRules] = {
    Node: KindRules(offered=True),
    Self: KindRules(persistent=True, moves_with_path=True, droppable=False),
    Percept: KindRules(indexed=True),
    Object: KindRules(indexed=True, moves_with_path=True, offered=True),
    PathSegment: KindRules(persistent=True, indexed=True, moves_with_path=True),
    Observations: KindRules(persistent=True, indexed=True),
    LoopClosure: KindRules(persistent=True, indexed=True),
    Correction: KindRules(persistent=True),
    Map: KindRules(persistent=True, indexed=True, moves_with_path=True, offered=True),
    Goal: KindRules(persistent=True, indexed=True, offered=True),
    Plan: KindRules(persistent=True, indexed=True),
    Recollection: KindRules(persistent=True, offered=True),
    Episode: KindRules(indexed=True, offered=True),
    Need: KindRules(persistent=True, indexed=True, offered=True),
    Attention: KindRules(persistent=True, droppable=False),
}


def kind_of(node: GraphNode) -> str:
    """Return the name of a node's kind, as it travels."""
    if isinstance(node, Node):
        return node.kind

    return kind_name(type(node))


def kind_name(kind: type[GraphNode]) -> str:
    """Return the name of a kind, as it travels."""
    return str(kind.__struct_config__.tag)
