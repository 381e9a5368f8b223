"""Trees of named nodes in an associative memory, each subtree a vector that is stored there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count

import numpy as np

from cogmap.geometry.arrays import Bytes
from services.memory.sparse.interface import AssociativeMemory
from services.memory.sparse.structures import ItemMemory
from services.memory.sparse.vectors import bind, bundle, contains, permuted, unbind

NAME = "name"
CHILD = "child"


@dataclass(frozen=True)
class Tree:
    """A node, and the trees below it in their order."""

    name: str
    children: tuple[Tree, ...] = ()


def write_tree(memory: AssociativeMemory, items: ItemMemory, tree: Tree) -> Bytes:
    """Store a tree and all below it; the vector that `read_tree` reads it from.

    A leaf is its item. Any other tree is the bundle of its name and of its children's vectors, each
    bound to the role of its place, and is stored at itself: a part that is unbound from a bundle is
    noisy, and cues the memory to complete it.
    """
    if not tree.children:
        return items.item(tree.name)

    parts = [bind(items.role(NAME), items.item(tree.name), items.values)]
    for place, child in enumerate(tree.children):
        below = write_tree(memory, items, child)
        parts.append(bind(_child_role(items, place), below, items.values))

    vector = bundle(np.stack(parts), items.values)
    memory.write(vector, vector)
    return vector


def read_tree(memory: AssociativeMemory, items: ItemMemory, vector: Bytes) -> Tree | None:
    """The tree of a vector; None where it is none. Children end at the first that is not known."""
    leaf = items.clean_up(vector)
    if leaf is not None:
        return Tree(leaf)

    recall = memory.read(vector)
    if recall is None or not contains(recall.vector, vector, items.values):
        return None

    name = items.clean_up(unbind(recall.vector, items.role(NAME), items.values))
    if name is None:
        return None

    return Tree(name, _children(memory, items, recall.vector))


def _children(memory: AssociativeMemory, items: ItemMemory, vector: Bytes) -> tuple[Tree, ...]:
    children: list[Tree] = []
    for place in count():
        part = unbind(vector, _child_role(items, place), items.values)
        child = read_tree(memory, items, part)
        if child is None:
            break
        children.append(child)

    return tuple(children)


def _child_role(items: ItemMemory, place: int) -> Bytes:
    return permuted(items.role(CHILD), place)
