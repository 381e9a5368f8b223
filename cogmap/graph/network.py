"""The graph as networkx's, for its algorithms and drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cogmap.errors import UsageError
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import kind_of
from cogmap.schemas.render import to_jsonable

if TYPE_CHECKING:
    import networkx


def as_networkx(graph: Graph) -> networkx.MultiDiGraph:
    """Return the nodes of `graph` but for place nodes, and their links: a link's kind is its key,
    and its weight is `weight`.

    A node has its fields as attributes, its `kind`, and `activation` and `base_level` as of now; an
    array is its dtype, shape, least and greatest value. A link to a place node leads to a node that
    has no attributes. Raises UsageError if there is no networkx.
    """
    try:
        import networkx
    except ImportError:
        raise UsageError(
            "this needs networkx: install it by `pip install 'cogmap[networks]'`"
        ) from None

    network = networkx.MultiDiGraph(cycle=graph.cycle, version=graph.version)
    for name, node in graph.nodes.items():
        attributes = {key: value for key, value in to_jsonable(node).items() if key != "type"}
        attributes["kind"] = kind_of(node)
        attributes["activation"] = graph.activation(node)
        attributes["base_level"] = graph.base_level(node)
        network.add_node(name, **attributes)

    for links in graph.links.in_bulk():
        for source, weights in links.weights.items():
            for target, weight in weights.items():
                network.add_edge(source, target, key=str(links.kind), weight=weight)
    return network
