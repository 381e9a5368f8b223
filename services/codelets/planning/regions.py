"""A coarser level of a place network (paper §5.5): its nodes are regions of finer ones.

A region is what is connected inside a block of finer nodes, and two regions are linked where nodes
of theirs are: a route exists on a level exactly where it exists on the finest. A region is numbered
by its first place node, so that a level does not depend on the order of changes that led to it.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from cogmap.geometry.arrays import Booleans, Floats, Indices
from services.codelets.planning.links import COST_UNIT_M, octile
from services.codelets.planning.slots import SlotGraph

Integers = npt.NDArray[np.integer[Any]]


class Rows(NamedTuple):
    """The links of some nodes, one node's after the other's.

    `counts`: how many links each node has. `columns`: the nodes that they lead to.
    """

    counts: Integers
    columns: Integers
    costs_m: Floats

    def owners(self) -> Indices:
        """For each link, the row of the node that it belongs to."""
        return np.repeat(np.arange(len(self.counts)), self.counts)


class Traits(NamedTuple):
    """What is known of nodes: `centre` (n, 2) in cells, `size` in places, and `slowness`, one
    over the mean weight of their links.
    """

    centre: Floats
    size: Floats
    slowness: Floats


class Level(Protocol):
    """The finer level that regions are made of."""

    def exist(self, nodes: Indices) -> Booleans:
        """Which numbers are nodes of this level."""

    def rows(self, nodes: Indices) -> Rows:
        """The links of nodes."""

    def traits(self, nodes: Indices) -> Traits:
        """What is known of nodes."""


class Regions:
    """The regions of a level, in blocks of `edge` places a side, over a grid (width, height).

    `region`: (n,) the region of each node of the finer level, -1 where there is none.
    """

    def __init__(self, finer: Level, grid: tuple[int, int], edge: int, cell_m: float) -> None:
        self._finer = finer
        self._edge = edge
        self._cell_m = cell_m
        width, self._height = grid
        self._blocks_high = self._height // edge
        self._count = width * self._height

        corner = np.arange(edge)
        self._inside = (corner[:, None] * self._height + corner).ravel()
        self._corner_of = self._corners(width)
        self.region = np.full(self._count, -1, np.int32)
        self._centre = np.zeros((self._count, 2))
        self._size = np.zeros(self._count)
        self._slowness = np.ones(self._count)

        # Links in order of (region, region it leads to), each as region * count + region.
        self._keys: Indices = np.zeros(0, np.int64)
        self._columns = np.zeros(0, np.int32)
        self._costs_m = np.zeros(0)
        self._starts = np.zeros(self._count + 1, np.int32)
        self.update(np.arange(self._count))

    def update(self, nodes: Indices) -> Indices:
        """Make regions anew in the blocks that hold finer `nodes`, whose links have changed.

        Returns the numbers of all places in those blocks.
        """
        blocks = np.unique(self._block_of(nodes))
        places = np.sort(self._places_in(blocks))
        self.region[places] = -1

        members = places[self._finer.exist(places)]
        links = self._finer.rows(members)
        self._label(members, links)
        self._describe(members)
        self._relink(blocks, members, links)
        return places

    def exist(self, nodes: Indices) -> Booleans:
        """Which numbers are regions."""
        exist: Booleans = self.region[nodes] == nodes
        return exist

    def traits(self, nodes: Indices) -> Traits:
        """What is known of regions."""
        return Traits(self._centre[nodes], self._size[nodes], self._slowness[nodes])

    def rows(self, nodes: Indices) -> Rows:
        """The links of regions."""
        starts = self._starts.take(nodes)
        counts = self._starts.take(nodes + 1) - starts
        ends = np.cumsum(counts)
        links = np.repeat(starts + counts - ends, counts)
        links += np.arange(len(links))
        return Rows(counts, self._columns.take(links), self._costs_m.take(links))

    def members(self, regions: Indices) -> Indices:
        """The nodes of the finer level in `regions`, in ascending order."""
        places = self._corner_of.take(regions)[:, None] + self._inside
        is_member = self.region.take(places) == regions[:, None]
        members: Indices = places[is_member]
        members.sort()
        return members

    def graph(self) -> tuple[Indices, SlotGraph]:
        """Every region, ascending, and their graph, in which they are numbered in that order."""
        regions = np.flatnonzero(self.region == np.arange(self._count))
        links = self.rows(regions)
        number_of = np.zeros(self._count, np.int32)
        number_of[regions] = np.arange(len(regions), dtype=np.int32)

        before = np.cumsum(links.counts) - links.counts
        owners = links.owners()
        slots = np.arange(len(owners)) - before[owners]
        most = links.counts.max(initial=1)
        costs_m = np.full((len(regions), most), np.inf)
        neighbours = np.empty(costs_m.shape, np.int32)
        neighbours[:] = np.arange(len(regions))[:, None]
        neighbours[owners, slots] = number_of[links.columns]
        costs_m[owners, slots] = links.costs_m
        return regions, SlotGraph(neighbours, costs_m)

    def _corners(self, width: int) -> Indices:
        """(n,): the first place of the block that each place lies in."""
        i = np.arange(width) // self._edge * self._edge
        j = np.arange(self._height) // self._edge * self._edge
        corners: Indices = i[:, None] * self._height + j
        return corners.ravel()

    def _block_of(self, nodes: Integers) -> Indices:
        i, j = np.divmod(nodes, self._height)
        blocks: Indices = i // self._edge * self._blocks_high + j // self._edge
        return blocks

    def _places_in(self, blocks: Indices) -> Indices:
        """The numbers of the places in blocks."""
        i, j = np.divmod(blocks, self._blocks_high)
        corners = self._edge * (i * self._height + j)
        places: Indices = corners[:, None] + self._inside
        return places.ravel()

    def _label(self, members: Indices, links: Rows) -> None:
        """Find the regions of finer nodes: what is connected inside a block."""
        if not len(members):
            return

        owners = links.owners()
        inside = self._block_of(members)[owners] == self._block_of(links.columns)
        rows = owners[inside]
        columns = np.searchsorted(members, links.columns[inside])
        shape = (len(members), len(members))
        connected = sparse.csr_matrix((np.ones(len(rows), bool), (rows, columns)), shape=shape)

        _, labels = connected_components(connected, directed=False)
        _, first = np.unique(labels, return_index=True)
        self.region[members] = members[first[labels]]

    def _describe(self, members: Indices) -> None:
        """Sum up what is known of the nodes of each region."""
        finer = self._finer.traits(members)
        regions, labels = np.unique(self.region[members], return_inverse=True)
        count = len(regions)

        size = np.bincount(labels, finer.size, count)
        slowness = np.bincount(labels, finer.size * finer.slowness, count)
        i = np.bincount(labels, finer.size * finer.centre[:, 0], count)
        j = np.bincount(labels, finer.size * finer.centre[:, 1], count)

        self._size[regions] = size
        self._slowness[regions] = slowness / size
        self._centre[regions] = np.stack([i / size, j / size], axis=-1)

    def _relink(self, blocks: Indices, members: Indices, links: Rows) -> None:
        """Replace the links of all regions in `blocks`, from those of the finer nodes there."""
        here = self.region[members].astype(np.int64)[links.owners()]
        there = self.region[links.columns].astype(np.int64)
        leaves = here != there
        outward = here[leaves] * self._count + there[leaves]
        inward = there[leaves] * self._count + here[leaves]
        added = np.unique(np.concatenate([outward, inward]))

        is_changed = np.zeros(self._count, bool)
        is_changed[self._places_in(blocks)] = True
        is_kept = ~(is_changed[self._keys // self._count] | is_changed[self._columns])
        kept = self._keys[is_kept]
        positions = np.searchsorted(kept, added)

        costs_m = self._link_costs_m(added)
        self._keys = np.insert(kept, positions, added)
        self._costs_m = np.insert(self._costs_m[is_kept], positions, costs_m)
        owners, columns = np.divmod(self._keys, self._count)
        self._columns = columns.astype(np.int32)
        self._starts[1:] = np.cumsum(np.bincount(owners, minlength=self._count))

    def _link_costs_m(self, keys: Indices) -> Floats:
        """What links cost: the length between centres, by the slowness of both regions."""
        here, there = np.divmod(keys, self._count)
        lengths_m = self._cell_m * octile(*(self._centre[here] - self._centre[there]).T)
        slowness = (self._slowness[here] + self._slowness[there]) / 2
        rounded: Floats = np.ceil(lengths_m * slowness / COST_UNIT_M) * COST_UNIT_M
        return rounded
