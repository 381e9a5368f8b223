"""Examples of operations, and of the messages that carry the graph."""

from __future__ import annotations

from cogmap.schemas.base import Message
from cogmap.schemas.examples import nodes
from cogmap.schemas.examples.arrays import ramp
from cogmap.schemas.graph import (
    Cells,
    Decay,
    Delta,
    DropLink,
    DropNode,
    DropPlaces,
    Link,
    Links,
    Operation,
    Phase,
    PlaceTile,
    Snapshot,
    SnapshotRequest,
)
from cogmap.schemas.nodes import TILE_SIDE, LinkKind, PlaceColumn


def messages() -> list[Message]:
    """A delta, a snapshot and the request for one."""
    return [_delta(), _snapshot(), SnapshotRequest(at_least=41)]


def operations() -> list[Operation]:
    """An operation of every type, and a node of every kind."""
    return [
        *nodes.every_kind(),
        instance_link(),
        _tile(),
        Links(
            kind=LinkKind.INSTANCE,
            weights={"percept:07": {"building-07": 1.0, "building-08": 0.25}},
        ),
        DropNode(id="building-03"),
        DropPlaces(map="map:1"),
        DropLink(source="self", target="place:map:1:2:-4", kind=LinkKind.INSTANCE),
        Cells(
            map="map:1",
            column=PlaceColumn.ROAD,
            cells=ramp(3, 2, dtype="<i4"),
            values=ramp(3, dtype="<f4"),
            cycle=6,
        ),
        _decay(),
    ]


def instance_link(weight: float = 0.75) -> Link:
    """A link of a kind other than the default."""
    return Link(
        source="self",
        target="place:map:1:3:-4",
        kind=LinkKind.INSTANCE,
        weight=weight,
    )


def _delta() -> Delta:
    return Delta(
        version=42,
        cycle=6,
        phase=Phase.OBJECTS,
        tasks=["6/localization"],
        operations=operations(),
        rejected=1,
        reasons=["proposal 6/landmark failed: too few samples"],
    )


def _snapshot() -> Snapshot:
    return Snapshot(
        version=42,
        cycle=6,
        phase=Phase.ATTENTION,
        decay=_decay(),
        nodes=[nodes.self_node(), nodes.object_node()],
        links=[Links(weights={"self": {"place:map:1:3:-4": 1.0}})],
        tiles=[_tile()],
    )


def _decay() -> Decay:
    return Decay(
        activation=0.5,
        base_level=0.0625,
        place_activation=0.125,
        forget_below=0.25,
        kept_base_level=0.5,
    )


def _tile() -> PlaceTile:
    return PlaceTile(
        map="map:1",
        x=-1,
        y=2,
        columns={PlaceColumn.ROAD: ramp(TILE_SIDE, TILE_SIDE, dtype="<f4")},
        activation_cycle=ramp(TILE_SIDE, TILE_SIDE, dtype="<i4"),
    )
