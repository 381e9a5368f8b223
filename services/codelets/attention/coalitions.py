"""Coalitions: the content that attention codelets bring to the global workspace."""

from __future__ import annotations

import msgspec

from cogmap.graph.graph import Graph
from schemas.array import Matrix
from schemas.cognition import Coalition
from schemas.graph import Link
from schemas.nodes import AnyNode, LinkKind, Object, Self, object_id
from schemas.sensing import Percept
from services.codelets.nodes import nodes_of


def coalition(codelet: str, nodes: list[AnyNode], graph: Graph, base_level: float) -> Coalition:
    """A coalition of `nodes`, with their links to places, and the maps they are on.

    Its activation is base-level x sum(total activation + |incentive salience|) / 2n over its nodes,
    as in LIDA's framework.
    """
    total = sum(graph.total_activation(node) + abs(_salience(node)) for node in nodes)
    activation = base_level * total / (2 * len(nodes))

    return Coalition(
        codelet=codelet,
        activation=min(1.0, activation),
        nodes=[_as_of_now(node, graph) for node in nodes],
        links=_links_to_places(nodes, graph),
        maps=_maps_of(nodes),
    )


def _links_to_places(nodes: list[AnyNode], graph: Graph) -> list[Link]:
    """The links of nodes to the places where they are."""
    links = []
    for node in nodes:
        place = graph.links.target(node.id, LinkKind.AT)
        if place is not None:
            links.append(Link(source=node.id, target=place, kind=LinkKind.AT))

    return links


def _maps_of(nodes: list[AnyNode]) -> list[str]:
    """The maps that nodes are on, each once, in the order of the nodes."""
    maps: dict[str, None] = {}
    for node in nodes:
        if isinstance(node, Self | Object):
            maps[node.map] = None

    return list(maps)


def objects_in_view(percepts: list[Percept], graph: Graph) -> list[Object]:
    """The objects of the map that are in view, by label."""
    labels = sorted(percept.label for percept in percepts)
    names = [object_id(label) for label in labels]
    return nodes_of(graph, Object, names)


def _salience(node: AnyNode) -> float:
    if isinstance(node, Object):
        return node.salience
    return 0.0


def _as_of_now(node: AnyNode, graph: Graph) -> AnyNode:
    """The node with its activation in this cycle, and the mean of its samples in place of them all:
    the global workspace broadcasts no more than that.
    """
    now = {
        "activation": graph.activation(node),
        "base_level": graph.base_level(node),
        "cycle": graph.cycle,
    }
    if isinstance(node, Object):
        return msgspec.structs.replace(node, offsets_m=None, **now)

    if isinstance(node, Self):
        mean = Matrix.of([[node.x_m, node.y_m, node.heading_rad]])
        return msgspec.structs.replace(node, samples=mean, **now)

    return msgspec.structs.replace(node, **now)
