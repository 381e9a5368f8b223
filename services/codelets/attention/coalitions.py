"""Coalitions: the content that attention codelets bring to the global workspace."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.cognition import Coalition, Relation
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import AnyNode, Goal, LinkKind, Object, Plan, Self, object_id
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.nodes import nodes_of


def coalition(
    codelet: str,
    nodes: list[AnyNode],
    graph: Graph,
    links: Iterable[Link] = (),
    *,
    percepts: Iterable[Percept] = (),
    feeling: Feeling = Feeling.NONE,
) -> Coalition:
    """Make a coalition of `nodes`, with their links to places and `links`, the maps they are on,
    how those among `percepts` stand to the agent, and the `feeling` about it.

    Its activation is sum(total activation + |incentive salience|) / 2n over its n nodes and links,
    as in LIDA's framework; the base level of attention codelets, by which LIDA multiplies that, is
    1, as they do not learn. A link is as active and as salient as the node that it begins at, whose
    activation it passes on, times its weight.
    """
    every_link = []
    for node in nodes:
        place = graph.links.target(node.id, LinkKind.AT)
        if place is not None:
            every_link.append(Link(source=node.id, target=place, kind=LinkKind.AT))

    every_link += links
    strengths = {node.id: graph.total_activation(node) + abs(node.salience) for node in nodes}
    total = sum(strengths.values())
    for link in every_link:
        total += link.weight * strengths.get(link.source, 0.0)

    relations = {}
    for percept in percepts:
        name = object_id(percept.label)
        if name in strengths and percept.has_bearing and percept.has_range:
            relations[name] = Relation(
                look=percept.name, range_m=percept.range_m, bearing_rad=percept.bearing_rad
            )

    # The maps that nodes are on, and the sub-maps that they are in, each once.
    maps: dict[str, None] = {}
    for node in nodes:
        if isinstance(node, Self | Object | Goal | Plan):
            maps[node.map] = None
        sub_map = graph.links.target(node.id, LinkKind.WITHIN)
        if sub_map is not None:
            maps[sub_map] = None

    number = len(nodes) + len(every_link)
    activation = total / (2 * number)
    return Coalition(
        codelet=codelet,
        activation=min(1.0, activation),
        nodes=[_as_of_now(node, graph) for node in nodes],
        links=every_link,
        maps=list(maps),
        relations=relations,
        feeling=feeling,
    )


def felt(node: AnyNode, salience: float) -> AnyNode:
    """Attach a feeling to a node."""
    return msgspec.structs.replace(node, salience=salience)


def objects_in_view(percepts: list[Percept], graph: Graph) -> list[Object]:
    """Return the objects of the map that are in view, by label, each as salient as its percept if
    that is more than what is felt about it in the graph.
    """
    saliences = {object_id(percept.label): percept.salience for percept in percepts}
    objects = []
    for node in nodes_of(graph, Object, sorted(saliences)):
        salience = max(node.salience, saliences[node.id], key=abs)
        objects.append(msgspec.structs.replace(node, salience=salience))

    return objects


def _as_of_now(node: AnyNode, graph: Graph) -> AnyNode:
    """Return the node with its activation in this cycle, the mean of its samples in place of them
    all, and without a route: the global workspace broadcasts no more than that.
    """
    now = {
        "activation": graph.activation(node),
        "base_level": graph.base_level(node),
        "cycle": graph.cycle,
    }
    if isinstance(node, Object):
        return msgspec.structs.replace(node, offsets_m=None, **now)

    if isinstance(node, Plan):
        return msgspec.structs.replace(node, route=None, **now)

    if isinstance(node, Self):
        mean = Matrix.of([[node.x_m, node.y_m, node.heading_rad]])
        return msgspec.structs.replace(node, samples=mean, **now)

    return msgspec.structs.replace(node, **now)
