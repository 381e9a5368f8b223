"""The Current Situational Model as it travels: links, place tiles, operations, deltas, snapshots.

Every operation states a result, never a change to one, so applying it twice is applying it once.
"""

from __future__ import annotations

import enum
from typing import Annotated

import msgspec

from cogmap.schemas.array import Array
from cogmap.schemas.base import Count, Finite, Message, Name, Part, Unit
from cogmap.schemas.nodes import ROOT_MAP, AnyNode, LinkKind, PlaceColumn


class Phase(enum.StrEnum):
    """The phases of a cognitive cycle in the workspace, in order; each ends with a commit.

    PERCEPTS: percepts and offers enter. CORRECTION: a correction of the map is applied.
    LOCALIZATION, OBJECTS, ATTENTION: codelets run. END: what has decayed is forgotten. BACKGROUND
    codelets run beside the cycle, in lanes of their own. LATE: answers that came after their cycle
    had ended.
    """

    PERCEPTS = "percepts"
    CORRECTION = "correction"
    LOCALIZATION = "localization"
    OBJECTS = "objects"
    ATTENTION = "attention"
    END = "end"
    BACKGROUND = "background"
    LATE = "late"


class Link(Part, kw_only=True, frozen=True, tag="link"):
    """A weighted link. A node has one link of a kind to one target."""

    source: Name
    target: Name
    kind: Name = LinkKind.AT
    weight: Finite = 1.0


class Links(Part, kw_only=True, frozen=True, tag="links"):
    """Many links of one kind: weights by source, then target. They join the links that exist."""

    kind: Name = LinkKind.AT
    weights: dict[Name, dict[Name, Finite]]


class PlaceTile(Part, kw_only=True, frozen=True, tag="tile"):
    """A square of place nodes in bulk: TILE_SIDE x TILE_SIDE cells of map `map`, row-major from
    tile (`x`, `y`).

    Cell (i, j) of the map is the node `place:MAP:i:j`. `columns` are float32 (TILE_SIDE, TILE_SIDE)
    each; one that is missing has its default everywhere. `activation_cycle`, int32 of the same
    shape, is the cycle as of which each activation is.
    """

    map: Name = ROOT_MAP
    x: Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31)]
    y: Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31)]
    columns: dict[PlaceColumn, Array]
    activation_cycle: Array | None = None


class Cells(Part, kw_only=True, frozen=True, tag="cells"):
    """New values of one column of some place nodes: int32 (n, 2) cells and float32 (n,) values.

    A tile that does not exist is created. Activations are as of `cycle`.
    """

    map: Name = ROOT_MAP
    column: PlaceColumn
    cells: Array
    values: Array
    cycle: Count = 0


class DropNode(Part, kw_only=True, frozen=True, tag="drop_node"):
    """Forget a node and all its links; of a map its place nodes too."""

    id: Name


class DropPlaces(Part, kw_only=True, frozen=True, tag="drop_places"):
    """Forget all place nodes of a map, as where its frame is another than they were made in."""

    map: Name


class DropLink(Part, kw_only=True, frozen=True, tag="drop_link"):
    """Forget one link."""

    source: Name
    target: Name
    kind: Name = LinkKind.AT


class Decay(Part, kw_only=True, frozen=True, tag="decay"):
    """By how much activation decays in a cycle (linear, as in LIDA's framework).

    A node is forgotten once its total activation is below `forget_below`. A base level that has
    reached `kept_base_level` does not decay below it: what was learned so well is not forgotten by
    time alone; 0: every base level decays.
    """

    activation: Unit = 0.0
    base_level: Unit = 0.0
    place_activation: Unit = 0.0
    forget_below: Unit = 0.0
    kept_base_level: Unit = 0.0


Operation = AnyNode | Link | Links | PlaceTile | DropNode | DropPlaces | DropLink | Cells | Decay


class Delta(Message, kw_only=True, frozen=True):
    """A numbered commit. `version` follows the one before by 1; `tasks` are those whose proposals
    are in it.

    `rejected` counts the answers since the delta before that are in none; `reasons` are those of
    the first few. At the end of a cycle `lineage` is a digest of all commits before this one: a
    replica of another lineage has received what the workspace did not commit.
    """

    version: Count
    cycle: Count
    phase: Phase
    tasks: list[str] = []
    operations: list[Operation]
    rejected: Count = 0
    reasons: list[str] = []
    lineage: Name | msgspec.UnsetType = msgspec.UNSET


class Snapshot(Message, kw_only=True, frozen=True):
    """The whole graph at `version`, in the course of `cycle` after its phase `phase`; `lineage` is
    a digest of all commits that it was made by.
    """

    version: Count
    cycle: Count
    phase: Phase = Phase.END
    decay: Decay
    nodes: list[AnyNode]
    links: list[Links]
    tiles: list[PlaceTile]
    lineage: Name | msgspec.UnsetType = msgspec.UNSET


class SnapshotRequest(Message, kw_only=True, frozen=True):
    """Asks the workspace for its graph, at `at_least` this version or newer."""

    at_least: Count = 0
