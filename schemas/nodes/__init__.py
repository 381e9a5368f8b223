"""The kinds of nodes, links and place columns: each is named here once, with its fields and rules.

A node of the graph is a struct of its kind, so that the decoder validates it. A kind that is not
known here travels as the generic `Node`: a codelet of somebody else's package needs no change of
this table. Positions are in metres in the frame of the map that the node is on, x east, y north.
"""

from schemas.nodes.attention import Attention, Need
from schemas.nodes.base import NEVER_NS, GraphNode, Node
from schemas.nodes.columns import (
    POSE_COLUMNS,
    TILE_CELLS,
    TILE_SIDE,
    CorrectionColumn,
    ObservationColumn,
    PathColumn,
    PlaceColumn,
    RecalledColumn,
    RouteColumn,
    SelfColumn,
)
from schemas.nodes.episode import Episode, Remembered
from schemas.nodes.ids import (
    CORRECTION_ID,
    PLAN_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    SELF_ID,
    attention_id,
    category_id,
    coarse_map_id,
    episode_id,
    feeling_id,
    goal_id,
    individual_label,
    is_coarse_map,
    look_of,
    map_id,
    map_number,
    nearest_place,
    need_id,
    object_id,
    observations_id,
    percept_id,
    place_cell,
    place_id,
    segment_id,
)
from schemas.nodes.links import EXCLUSIVE_LINKS, LinkKind
from schemas.nodes.path import Correction, LoopClosure, Observations, PathSegment
from schemas.nodes.planning import Goal, Plan, PlanState
from schemas.nodes.recollection import Recollection, SubMap
from schemas.nodes.rules import KINDS, AnyNode, KindRules, kind_name, kind_of
from schemas.nodes.situation import Map, Object, Percept, Self

__all__ = [
    "CORRECTION_ID",
    "EXCLUSIVE_LINKS",
    "KINDS",
    "NEVER_NS",
    "PLAN_ID",
    "POSE_COLUMNS",
    "RECOLLECTION_ID",
    "ROOT_MAP",
    "SELF_ID",
    "TILE_CELLS",
    "TILE_SIDE",
    "AnyNode",
    "Attention",
    "Correction",
    "CorrectionColumn",
    "Episode",
    "Goal",
    "GraphNode",
    "KindRules",
    "LinkKind",
    "LoopClosure",
    "Map",
    "Need",
    "Node",
    "Object",
    "ObservationColumn",
    "Observations",
    "PathColumn",
    "PathSegment",
    "Percept",
    "PlaceColumn",
    "Plan",
    "PlanState",
    "RecalledColumn",
    "Recollection",
    "Remembered",
    "RouteColumn",
    "Self",
    "SelfColumn",
    "SubMap",
    "attention_id",
    "category_id",
    "coarse_map_id",
    "episode_id",
    "feeling_id",
    "goal_id",
    "individual_label",
    "is_coarse_map",
    "kind_name",
    "kind_of",
    "look_of",
    "map_id",
    "map_number",
    "nearest_place",
    "need_id",
    "object_id",
    "observations_id",
    "percept_id",
    "place_cell",
    "place_id",
    "segment_id",
]
