"""The Current Situational Model as it travels: nodes, links, place tiles, operations, deltas,
snapshots.

Every operation states a result, never a change to one, so applying it twice is applying it once.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from schemas.array import Array
from schemas.base import Count, Finite, Message, Name, Part, Scalar
from schemas.sensing import Unit


class Node(Part, kw_only=True, tag="node"):
    """A node of the graph. `samples`: float64 (n, d), positions (x_m, y_m) or poses (x_m, y_m,
    heading_rad).

    Nodes of the kinds `path` and `correction` have rows of their own there: see
    services.codelets.mapping.path.
    """

    id: Name
    kind: Name
    activation: Unit = 0.0
    base_level: Unit = 0.0
    attributes: dict[str, Scalar] = {}
    samples: Array | None = None


class Link(Part, kw_only=True, tag="link"):
    """A weighted link. A node has one link of a kind to one target."""

    source: Name
    target: Name
    kind: Name = "at"
    weight: Finite = 1.0


class Links(Part, kw_only=True, tag="links"):
    """Many links of one kind: weights by source, then target. They join the links that there are."""

    kind: Name = "at"
    weights: dict[Name, dict[Name, Finite]]


class PlaceTile(Part, kw_only=True, tag="tile"):
    """A square of place nodes in bulk: `side` x `side` cells of `cell_m`, row-major from (`x`, `y`)
    in tiles.

    Cell (i, j) of the whole plane is the node `place:i:j`. `activation`, `road` and `traversable`
    are float32 (side, side); each cell links to its eight neighbours with the mean of the two
    cells' `traversable`.
    """

    x: int
    y: int
    side: Annotated[int, msgspec.Meta(ge=1, le=256)]
    cell_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    activation: Array
    road: Array
    traversable: Array


class DropNode(Part, kw_only=True, tag="drop_node"):
    """Forget a node and all its links."""

    id: Name


class DropLink(Part, kw_only=True, tag="drop_link"):
    """Forget one link."""

    source: Name
    target: Name
    kind: Name = "at"


class Activations(Part, kw_only=True, tag="activations"):
    """New activations and base-levels of many nodes, float32 (n,): decay in bulk. An unknown node
    is passed over.
    """

    ids: list[Name]
    values: Array
    base_levels: Array


class Cells(Part, kw_only=True, tag="cells"):
    """New values of some place nodes: int32 (n, 2) cells and a column float32 (n,). Unknown tiles
    come into being.
    """

    column: Name
    cells: Array
    values: Array


Operation = Node | Link | Links | PlaceTile | DropNode | DropLink | Activations | Cells


class Proposal(Message, kw_only=True):
    """A codelet's answer to a task: operations on the graph as of `base_version`."""

    task_id: Name
    worker: Name
    codelet: Name
    base_version: Count
    operations: list[Operation]
    failure: str = ""


class Delta(Message, kw_only=True):
    """A numbered commit. `version` follows the one before by 1; `tasks` are those whose proposals
    are in it.

    `dropped` counts the answers since the delta before that are in none, and `refused` says why, of
    the first few.
    """

    version: Count
    cycle: Count
    phase: Name
    tasks: list[str]
    operations: list[Operation]
    dropped: Count = 0
    refused: list[str] = []


class Snapshot(Message, kw_only=True):
    """The whole graph at `version`."""

    version: Count
    cycle: Count
    nodes: list[Node]
    links: list[Link]
    tiles: list[PlaceTile]


class SnapshotRequest(Message, kw_only=True):
    """Asks the workspace for its graph, at `at_least` this version or newer."""

    at_least: Count = 0
