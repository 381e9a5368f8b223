"""A coarser level of a place network (paper §5.5): its nodes are regions of finer ones.

A region is what is connected inside a block of finer nodes, and two regions are linked where nodes
of theirs are: a route exists on a level exactly where it exists on the finest. A region has the
number of its first place node, so that a level does not depend on the order of changes that led to
it.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.services.codelets.planning.search.links import in_cost_units, octile
from cogmap.services.codelets.planning.search.slots import SlotGraph

Integers = npt.NDArray[np.integer[Any]]


class Rows(NamedTuple):
    """The links of some nodes, one node's after the other's.

    `counts`: how many links each node has. `columns`: the nodes that they lead to.
    """

    counts: Integers
    columns: Integers

    def owners(self) -> Indices:
        """For each link, the index of the node that it belongs to."""
        count = len(self.counts)
        every = np.arange(count)
        return np.repeat(every, self.counts)

    def slots(self) -> Indices:
        """For each link, which of its node's links it is, from 0."""
        ends = np.cumsum(self.counts)
        starts = ends - self.counts
        every = np.arange(self.counts.sum())
        slots: Indices = every - np.repeat(starts, self.counts)
        return slots


class Traits(NamedTuple):
    """What regions are described by: `centre` (n, 2) in cells, `size` in places, and `slowness`,
    one over the mean weight of their places' links.
    """

    centre: Singles
    size: Singles
    slowness: Singles


class Level(Protocol):
    """The finer level that regions are made of."""

    def exist(self, nodes: Indices) -> Booleans:
        """Which numbers are nodes of this level."""

    def rows(self, nodes: Indices) -> Rows:
        """The links of nodes."""

    def traits(self, nodes: Indices) -> Traits:
        """What nodes are described by."""


class Regions:
    """The regions of a level, in blocks of `edge` places a side, over a grid (width, height).

    `region`: (n,) the region of each node of the finer level, -1 where there is none.
    """

    def __init__(self, finer: Level, grid: tuple[int, int], edge: int, cell_m: float) -> None:
        width, height = grid
        self._finer = finer
        self._edge = edge
        self._cell_m = cell_m
        self._height = height
        self._count = width * height

        along = np.arange(edge)
        self._inside = (along[:, None] * height + along).ravel()
        every = np.arange(self._count)
        self._corner_of = self._corners(every).astype(np.int32)

        self.region = np.full(self._count, -1, np.int32)
        self._traits = Traits(
            np.zeros((self._count, 2), np.float32),
            np.zeros(self._count, np.float32),
            np.ones(self._count, np.float32),
        )

        # Links in order of (region, region it leads to), each as region * count + region.
        self._keys: Indices = np.zeros(0, np.int64)
        self._columns = np.zeros(0, np.int32)
        self._starts = np.zeros(self._count + 1, np.int32)
        self.update(every)

    def update(self, nodes: Indices) -> Indices:
        """Make regions anew in the blocks that hold finer `nodes`, whose links have changed.

        Returns all places in those blocks.
        """
        corners = np.unique(self._corner_of[nodes])
        places = self._places_at(corners)
        places.sort()
        self.region[places] = -1

        members = places[self._finer.exist(places)]
        links = self._finer.rows(members)
        self._label(members, links)
        self._describe(members)

        added = self._links_between(members, links)
        self._replace_links(places, added)
        return places

    def exist(self, nodes: Indices) -> Booleans:
        """Which numbers are regions."""
        exist: Booleans = self.region[nodes] == nodes
        return exist

    def traits(self, nodes: Indices) -> Traits:
        """What regions are described by."""
        centre, size, slowness = self._traits
        return Traits(centre[nodes], size[nodes], slowness[nodes])

    def rows(self, nodes: Indices) -> Rows:
        """The links of regions."""
        starts = self._starts[nodes]
        counts = self._starts[nodes + 1] - starts
        ends = np.cumsum(counts)

        # Number k of all these links is number k + first of those that are kept.
        first = np.repeat(starts + counts - ends, counts)
        links = first + np.arange(len(first))
        return Rows(counts, self._columns[links])

    def members(self, regions: Indices) -> Indices:
        """The nodes of the finer level in `regions`, in ascending order."""
        corners = self._corner_of.take(regions)
        places = corners[:, None] + self._inside
        is_member = self.region.take(places) == regions[:, None]

        members: Indices = places[is_member]
        members.sort()
        return members

    def graph(self) -> tuple[Indices, SlotGraph]:
        """Every region, ascending, and their graph, in which they are numbered in that order."""
        every = np.arange(self._count)
        is_region = self.exist(every)
        regions = np.flatnonzero(is_region)
        number_of = np.cumsum(is_region, dtype=np.int32) - np.int32(1)
        links = self.rows(regions)

        # An empty slot leads back to its owner, at an infinite cost.
        shape = (len(regions), links.counts.max(initial=1))
        costs_m = np.full(shape, np.inf)
        neighbours = np.empty(shape, np.int32)
        neighbours.T[:] = number_of[regions]

        owners = links.owners()
        slots = links.slots()
        costs_m[owners, slots] = self._costs_m(regions[owners], links.columns)
        neighbours[owners, slots] = number_of[links.columns]
        return regions, SlotGraph(neighbours, costs_m)

    def _corners(self, places: Integers) -> Indices:
        """The first place of the block that each place lies in."""
        i, j = np.divmod(places, self._height)
        first_i = i - i % self._edge
        first_j = j - j % self._edge
        corners: Indices = first_i * self._height + first_j
        return corners

    def _places_at(self, corners: Integers) -> Indices:
        """The places of blocks that begin at `corners`."""
        places: Indices = corners[:, None] + self._inside
        return places.ravel()

    def _label(self, members: Indices, links: Rows) -> None:
        """Find the regions of finer nodes: what is connected inside a block."""
        if not len(members):
            return

        owners = links.owners()
        here = self._corner_of[members][owners]
        there = self._corner_of[links.columns]
        is_inside = here == there

        rows = owners[is_inside]
        columns = np.searchsorted(members, links.columns[is_inside])
        ones = np.ones(len(rows), bool)
        shape = (len(members), len(members))
        inside = sparse.csr_matrix((ones, (rows, columns)), shape=shape)

        _, labels = connected_components(inside, directed=False)
        _, first = np.unique(labels, return_index=True)
        self.region[members] = members[first[labels]]

    def _describe(self, members: Indices) -> None:
        """Sum up what the nodes of each region are described by."""
        centre, size, slowness = self._finer.traits(members)
        regions, labels = np.unique(self.region[members], return_inverse=True)
        i, j = centre.T

        total = np.bincount(labels, size)
        mean_i = np.bincount(labels, size * i) / total
        mean_j = np.bincount(labels, size * j) / total
        mean_slowness = np.bincount(labels, size * slowness) / total

        self._traits.centre[regions, 0] = mean_i
        self._traits.centre[regions, 1] = mean_j
        self._traits.size[regions] = total
        self._traits.slowness[regions] = mean_slowness

    def _links_between(self, members: Indices, links: Rows) -> Indices:
        """The keys, ascending, of the links of the regions of `members` with any other."""
        owners = links.owners()
        here = self.region[members][owners].astype(np.int64)
        there = self.region[links.columns].astype(np.int64)
        is_between = here != there
        here = here[is_between]
        there = there[is_between]

        outward = here * self._count + there
        inward = there * self._count + here
        return np.unique(np.concatenate([outward, inward]))

    def _replace_links(self, places: Indices, added: Indices) -> None:
        """Replace the links of all regions in `places` by those whose keys are `added`."""
        is_changed = np.zeros(self._count, bool)
        is_changed[places] = True
        owners = self._keys // self._count
        is_dropped = is_changed[owners] | is_changed[self._columns]

        kept = self._keys[~is_dropped]
        positions = np.searchsorted(kept, added)
        self._keys = np.insert(kept, positions, added)

        owners, columns = np.divmod(self._keys, self._count)
        self._columns = columns.astype(np.int32)
        counts = np.bincount(owners, minlength=self._count)
        np.cumsum(counts, out=self._starts[1:])

    def _costs_m(self, here: Integers, there: Integers) -> Floats:
        """What links cost: the length between centres, by the mean slowness of both regions."""
        centre, _, slowness = self._traits
        offsets = centre[here].astype(np.float64) - centre[there]
        i, j = offsets.T
        lengths_m = self._cell_m * octile(i, j)

        both = slowness[here] + slowness[there]
        return in_cost_units(lengths_m * both / 2)
