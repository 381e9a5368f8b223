"""The objects of the map, found by where they stand, by name and by look without visiting all."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from itertools import islice, product

import numpy as np

from cogmap.geometry.arrays import Indices, Singles
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Delta, DropNode
from cogmap.schemas.nodes import Object, object_id
from cogmap.schemas.sensing import Appearance

SQUARE_M = 16.0
"""Side of the squares by which objects are found; about as far as buildings stand apart."""

MAX_ALIKE = 64
"""Objects with one name, at most, that a percept is compared with: some streets of equal houses."""

MAX_COMPARED = 512
"""Objects whose appearance a percept is compared with at most: those of some districts."""

Square = tuple[str, int, int]


class KnownObjects:
    """The objects of a graph, by the square of the map that each stands on and by its name."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._square_of: dict[str, Square] = {}
        self._on_square: defaultdict[Square, dict[str, None]] = defaultdict(dict)
        self._name_of: dict[str, str] = {}
        self._of_name: defaultdict[str, dict[str, None]] = defaultdict(dict)
        self._appearances: dict[str, Matrix] = {}
        self._stacked: tuple[list[str], Indices, Singles] | None = None

    def restore(self) -> None:
        """Begin anew with all objects of the graph."""
        for label in list(self._square_of):
            self._drop(label)
        for node in self._graph.of_kind(Object):
            self._put(node)

    def note(self, delta: Delta) -> None:
        """Take up the objects that a delta has written or dropped."""
        for operation in delta.operations:
            if isinstance(operation, Object):
                self._put(operation)
            elif isinstance(operation, DropNode) and operation.id.startswith(object_id("")):
                self._drop(operation.id.removeprefix(object_id("")))

    def __len__(self) -> int:
        """Return how many objects there are."""
        return len(self._square_of)

    def near(self, map_id: str, x_m: float, y_m: float, within_m: float) -> list[Object]:
        """Return the objects of a map on squares that are at most so far from a position."""
        columns = range(_square(x_m - within_m), _square(x_m + within_m) + 1)
        rows = range(_square(y_m - within_m), _square(y_m + within_m) + 1)
        labels: list[str] = []
        for column, row in product(columns, rows):
            labels += self._on_square.get((map_id, column, row), ())

        return self._nodes(labels)

    def called(self, name: str) -> list[Object]:
        """Return the objects of that name, the first MAX_ALIKE of them."""
        return self._nodes(islice(self._of_name.get(name, ()), MAX_ALIKE))

    def count_called(self, name: str) -> int:
        """Return how many objects have that name."""
        return len(self._of_name.get(name, ()))

    @property
    def has_appearances(self) -> bool:
        """Return whether the appearance of any object is known."""
        return bool(self._appearances)

    def alike(self, seen: Appearance) -> tuple[list[Object], list[float]]:
        """Return the objects whose appearance is known, with the cosine of `seen` and the side of
        each that is most like it; of very many those that were learned last.
        """
        if self._stacked is None:
            labels = list(self._appearances)[-MAX_COMPARED:]
            sides = [self._appearances[label].numpy() for label in labels]
            numbers = np.repeat(np.arange(len(labels)), [len(side) for side in sides])
            self._stacked = labels, numbers, np.vstack(sides).astype(np.float32)

        labels, numbers, directions = self._stacked
        direction = np.asarray(seen.direction.numpy(), np.float32)
        cosines = np.full(len(labels), -1.0, np.float32)
        if directions.shape[1:] == direction.shape:
            np.maximum.at(cosines, numbers, directions @ direction)
        return self._nodes(labels), cosines.tolist()

    def _nodes(self, labels: Iterable[str]) -> list[Object]:
        nodes = [self._graph.get(Object, object_id(label)) for label in labels]
        return [node for node in nodes if node is not None]

    def _put(self, node: Object) -> None:
        label = node.label
        square = (node.map, _square(node.x_m), _square(node.y_m))
        if self._square_of.get(label) != square or self._name_of[label] != node.look:
            self._remove(label)
            self._square_of[label] = square
            self._on_square[square][label] = None
            self._name_of[label] = node.look
            self._of_name[node.look][label] = None

        appearances = node.appearances
        if appearances is not None and self._appearances.get(label) is not appearances:
            self._stacked = None
            self._appearances.pop(label, None)
            self._appearances[label] = appearances

    def _drop(self, label: str) -> None:
        self._remove(label)
        if self._appearances.pop(label, None) is not None:
            self._stacked = None

    def _remove(self, label: str) -> None:
        square = self._square_of.pop(label, None)
        if square is None:
            return

        del self._on_square[square][label]
        del self._of_name[self._name_of.pop(label)][label]


def _square(along_m: float) -> int:
    return int(along_m // SQUARE_M)
