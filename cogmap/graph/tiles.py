"""Which tiles cells lie in."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from cogmap.geometry.arrays import Indices
from cogmap.graph.window import Extent
from cogmap.schemas.nodes import TILE_SIDE

Slices = tuple[slice, slice]
# A key of 64 bits holds x and y of a tile, 32 bits each.
_KEY_STEP = 2**32


def tiles_of(cells: Indices) -> list[tuple[int, int]]:
    """Return the tiles (x, y) that (n, 2) cells lie in, in order."""
    if not len(cells):
        return []

    keys = _tile_keys(cells)
    if _are_same(keys):
        return [_tile(int(keys[0]))]
    return [_tile(key) for key in np.unique(keys).tolist()]


def by_tile(cells: Indices) -> Iterator[tuple[tuple[int, int], Indices | slice]]:
    """Yield each tile (x, y) that (n, 2) cells lie in, and which cells those are, in order."""
    if not len(cells):
        return

    keys = _tile_keys(cells)
    if _are_same(keys):
        yield _tile(int(keys[0])), slice(None)
        return

    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    starts = np.flatnonzero(ordered[1:] != ordered[:-1]) + 1

    for first, last in pairwise([0, *starts.tolist(), len(keys)]):
        yield _tile(int(ordered[first])), order[first:last]


def _tile_keys(cells: Indices) -> Indices:
    """Number the tile of each of (n, 2) cells, (n,), in order of tiles."""
    tiles = cells.astype(np.int64, copy=False) // TILE_SIDE
    keys: Indices = tiles[:, 0] * _KEY_STEP + tiles[:, 1]
    return keys


def _are_same(keys: Indices) -> bool:
    """Return true if all tiles are one, as in most changes."""
    return bool((keys == keys[0]).all())


def _tile(key: int) -> tuple[int, int]:
    """Return the tile (x, y) of a number of `_tile_keys`."""
    x, from_lowest = divmod(key + _KEY_STEP // 2, _KEY_STEP)
    return x, from_lowest - _KEY_STEP // 2


def positions_in(extent: Extent) -> Iterator[tuple[int, int]]:
    """Yield the tiles (x, y) that have cells in `extent`, whether they exist or not."""
    if not all(extent.shape):
        return

    first_x, first_y = (lower // TILE_SIDE for lower in extent.lower)
    last_x, last_y = ((upper - 1) // TILE_SIDE for upper in extent.upper)
    for x in range(first_x, last_x + 1):
        for y in range(first_y, last_y + 1):
            yield x, y


def overlap(x: int, y: int, extent: Extent) -> tuple[Slices, Slices]:
    """Return the cells of tile (x, y) that lie in `extent`: within the tile, and within
    the extent.
    """
    inside = []
    within = []
    for number, lower, upper in zip((x, y), extent.lower, extent.upper, strict=True):
        start = number * TILE_SIDE
        first = max(start, lower)
        last = min(start + TILE_SIDE, upper)
        inside.append(slice(first - start, last - start))
        within.append(slice(first - lower, last - lower))

    return (inside[0], inside[1]), (within[0], within[1])
