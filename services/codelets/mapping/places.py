"""The links of nodes to the places that they are at (paper §5.2)."""

from __future__ import annotations

from schemas.graph import DropLink, Link, Node, Operation


def place_link(node: Node, cell: str) -> list[Operation]:
    """The link of a node to its place, in place of the one it had."""
    old = str(node.attributes.get("place", ""))
    dropped: list[Operation] = [DropLink(source=node.id, target=old)] if old and old != cell else []
    return [*dropped, Link(source=node.id, target=cell)]
