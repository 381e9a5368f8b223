"""Perceptual associative memory as a graph: nodes that were conscious together get linked, and a
conscious node primes those that it is linked to (LIDA's PAM; paper §5.1).

A weight estimates how likely its target is conscious soon before or after its source; that of a
link from a relation, how likely its target stands in that relation. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.schemas.array import Array
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.nodes import feeling_id, is_relation
from cogmap.schemas.sensing import Associations
from cogmap.services.epam.config import Priming

MAX_NODES = 512
"""A full graph replaces the node that was least conscious; 512 nodes have 2 MB of weights."""
FAINT = 0.01
"""Weaker links are not published, and prime nothing."""
LEARNING_RATE = 0.1
"""How far one broadcast moves base levels and weights of links towards what was conscious. LIDA: no
published rate that we know.
"""
FEELING_RATE = 0.5
"""How far one broadcast moves the link from a PAM node to what is felt with it towards 1: a danger
is known after one encounter. LIDA gives no rate.
"""
FEELING_UNLEARNING_RATE = 0.02
"""How far one broadcast of a PAM node moves its links to feelings that are not felt with it towards
0: fear is extinguished more slowly than it is learned. Novelty wears off as fast as it comes.
"""
FEELINGS = {feeling_id(feeling): feeling for feeling in Feeling if feeling}
"""The PAM nodes that are feelings, by name."""


class AssociativeGraph:
    """PAM nodes with a base level and a current activation, and weighted links between them.

    The activation of a node is 1 at a broadcast of it and halves every `half_life_s`.

    Feelings are nodes too: links lead to them from what was conscious in the same broadcast, but
    none from them, since a feeling is no evidence of what is there. Relations, such as to stand
    left of the bakery, are nodes from which links lead to what stood in them, and none back: a
    relation is activated by what is seen beside something else, not by a broadcast.
    """

    def __init__(self, config: Priming) -> None:
        self._config = config
        self._updated_ns = 0
        self._index: dict[str, int] = {}
        self._base_levels: Floats = np.zeros(0)
        self._activations: Floats = np.zeros(0)
        self._weights: Floats = np.zeros((0, 0))

    @property
    def updated_ns(self) -> int:
        """Return the stamp of the last broadcast that was learned from, 0 before the first."""
        return self._updated_ns

    def be_at(self, now_ns: int) -> None:
        """Let it be `now_ns`: what was learned from was not conscious later than that."""
        self._updated_ns = min(self._updated_ns, now_ns)

    def learn(
        self, names: list[str], stamp_ns: int, related: Mapping[str, str] | None = None
    ) -> None:
        """Learn from a broadcast of the nodes `names`, and of relations with the name that stood in
        each.

        Base levels rise. Each weight moves towards the activation of its target, by a rate times
        that of its source: a node that has long been silent keeps its links. Those to feelings
        change by rates of their own, those from a relation when it is conscious.
        """
        self._activations = self._activations * self._remaining_share(stamp_ns)
        self._updated_ns = max(self._updated_ns, stamp_ns)
        stood = related or {}
        for name in (*names, *stood):
            self._add(name)
        conscious = self._rows(names)
        self._activations[conscious] = 1.0

        raised = conscious + self._rows(stood)
        levels = self._base_levels.copy()
        levels[raised] += LEARNING_RATE * (1 - levels[raised])
        self._base_levels = levels

        is_relative = np.array([is_relation(name) for name in self._index], np.bool_)
        is_associated: Booleans = ~self._is_feeling() & ~is_relative
        between = np.ix_(is_associated, is_associated)
        activations = self._activations[is_associated]
        weights = self._weights[between]
        missing = activations[None, :] - weights
        changed = weights + LEARNING_RATE * activations[:, None] * missing
        np.fill_diagonal(changed, 0.0)
        self._weights[between] = changed

        # Links to feelings, from what is conscious: towards 1 to what is felt now, towards 0 to
        # others.
        columns = {self._index[name]: name for name in FEELINGS if name in self._index}
        rows = [row for row in conscious if row not in columns]
        for column, name in columns.items():
            is_felt = column in conscious
            wears_off = FEELINGS[name] is Feeling.NOVELTY
            rate = FEELING_RATE if is_felt or wears_off else FEELING_UNLEARNING_RATE
            felt_weights = self._weights[rows, column]
            self._weights[rows, column] = felt_weights + rate * (float(is_felt) - felt_weights)

        for relation, name in stood.items():
            if relation in self._index and name in self._index:
                weights = self._weights[self._index[relation]]
                weights[is_associated] *= 1 - LEARNING_RATE
                weights[self._index[name]] += LEARNING_RATE

    def related(self) -> dict[str, dict[str, float]]:
        """Return what stands in each relation, with the weight of the link to it."""
        names = list(self._index)
        standing = {}
        for name, row in self._index.items():
            if is_relation(name):
                weights = self._weights[row]
                targets = np.flatnonzero(weights >= FAINT)
                standing[name] = {names[target]: float(weights[target]) for target in targets}

        return standing

    def primed(self, stamp_ns: int) -> Mapping[str, float]:
        """Return the nodes that activation has spread to by `stamp_ns`, each with what came over
        its best link.
        """
        if not self._index:
            return {}

        sources = self._activations * self._remaining_share(stamp_ns)
        spread = (sources[:, None] * self._weights).max(axis=0)
        names = list(self._index)
        return {names[row]: float(spread[row]) for row in np.flatnonzero(spread >= FAINT)}

    def feelings(self, name: str, activation: float) -> dict[Feeling, float]:
        """Return the feelings that a node of this `activation` activates over its links above their
        threshold; none if it is not known.
        """
        threshold = self._config.feeling_threshold
        row = self._index.get(name)
        if row is None:
            return {}

        felt = {}
        for feeling_name, feeling in FEELINGS.items():
            column = self._index.get(feeling_name)
            passed = 0.0 if column is None else activation * float(self._weights[row, column])
            if passed > threshold:
                felt[feeling] = passed

        return felt

    def __contains__(self, name: str) -> bool:
        """Return true if there is a PAM node of that name."""
        return name in self._index

    def published(self) -> Associations:
        """Return the graph as a message, without FAINT links."""
        sources, targets = np.nonzero(self._weights >= FAINT)
        return Associations(
            updated_ns=self._updated_ns,
            names=list(self._index),
            base_levels=Array.of(self._base_levels),
            activations=Array.of(self._activations),
            sources=Array.of(sources, "<i4"),
            targets=Array.of(targets, "<i4"),
            weights=Array.of(self._weights[sources, targets]),
        )

    def restore(self, kept: Associations) -> None:
        """Replace the graph by one that was published. Raises MessageError if its parts do not fit
        together.
        """
        count = len(kept.names)
        sources = np.asarray(kept.sources.numpy(), np.int64)
        targets = np.asarray(kept.targets.numpy(), np.int64)
        values = np.asarray(kept.weights.numpy(), np.float64)
        of_nodes = (kept.base_levels.shape, kept.activations.shape)
        is_whole = of_nodes == ((count,), (count,)) and len({*kept.names}) == count
        if not is_whole or not sources.shape == targets.shape == values.shape:
            raise MessageError(f"associations of {count} names: arrays of other lengths")

        ends = np.concatenate([sources, targets])
        if ends.size and not 0 <= ends.min() <= ends.max() < count:
            raise MessageError(f"associations of {count} names: a link leads to none of them")

        self._updated_ns = kept.updated_ns
        self._index = {name: row for row, name in enumerate(kept.names)}
        self._base_levels = np.array(kept.base_levels.numpy(), np.float64)
        self._activations = np.array(kept.activations.numpy(), np.float64)
        self._weights = np.zeros((count, count))
        self._weights[sources, targets] = values

    def _remaining_share(self, stamp_ns: int) -> float:
        """Compute the share of activation that remains at `stamp_ns`."""
        passed_s = max(0, stamp_ns - self._updated_ns) / 1e9
        return float(0.5 ** (passed_s / self._config.half_life_s))

    def _rows(self, names: Iterable[str]) -> list[int]:
        """Return the rows of those names that have one."""
        return [self._index[name] for name in names if name in self._index]

    def _is_feeling(self) -> Booleans:
        """Return which nodes are feelings, (n,)."""
        return np.array([name in FEELINGS for name in self._index], np.bool_)

    def _add(self, name: str) -> None:
        """Add a node, in a full graph in the place of the one that was conscious least and is no
        feeling.
        """
        if name in self._index:
            return
        if len(self._index) < MAX_NODES:
            self._index[name] = len(self._index)
            self._base_levels = np.append(self._base_levels, 0.0)
            self._activations = np.append(self._activations, 0.0)
            self._weights = np.pad(self._weights, (0, 1))
            return

        row = int(np.where(self._is_feeling(), np.inf, self._base_levels).argmin())
        names = list(self._index)
        names[row] = name
        self._index = {each: number for number, each in enumerate(names)}
        self._base_levels[row] = 0.0
        self._activations[row] = 0.0
        self._weights[row, :] = 0.0
        self._weights[:, row] = 0.0
