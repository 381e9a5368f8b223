"""What every node has, the node of a kind unknown here, and the types of their fields."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Count, Name, Part, Scalar, Unit

NEVER_NS = -1

Positive = Annotated[float, msgspec.Meta(gt=0, le=1e9)]
Salience = Annotated[float, msgspec.Meta(ge=-1, le=1)]
Spread = Annotated[float, msgspec.Meta(ge=0, le=1e9)]
Stamp = Annotated[int, msgspec.Meta(ge=NEVER_NS, le=2**62)]


class GraphNode(Part, kw_only=True, frozen=True):
    """What every node has. `activation` and `base_level` are as of cognitive cycle `cycle`; their
    values now follow from the graph's decay.

    `salience` is the feeling attached to the node, LIDA's incentive salience: how much it matters
    now, below 0 if it is bad or is missed.
    """

    id: Name
    activation: Unit = 0.0
    base_level: Unit = 0.0
    cycle: Count = 0
    salience: Salience = 0.0


class Node(GraphNode, kw_only=True, frozen=True, tag="node"):
    """A node of a kind that is not in this table."""

    kind: Name
    attributes: dict[str, Scalar] = {}
    samples: Matrix | None = None
