"""Place nodes in bulk: tiles of columns, by map."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.graph.tiles import by_tile, overlap, positions_in
from cogmap.graph.window import LINK_OFFSETS, WEIGHT_COLUMNS, Extent, Window
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Link, PlaceTile
from cogmap.schemas.nodes import TILE_SIDE, LinkKind, PlaceColumn, place_id

Column = npt.NDArray[np.float32]
TileKey = tuple[str, int, int]
# 128 MiB a column.
MAX_WINDOW_CELLS = 2**25
_SHAPE = (TILE_SIDE, TILE_SIDE)

DEFAULTS: dict[PlaceColumn, float] = dict.fromkeys(PlaceColumn, 0.0)
DEFAULTS |= dict.fromkeys(WEIGHT_COLUMNS, 1.0)


class Place(NamedTuple):
    """One place node."""

    id: str
    x_m: float
    y_m: float
    activation: float
    road: float
    obstacle: float


class Tile:
    """TILE_SIDE x TILE_SIDE place nodes: float32 columns indexed [i, j] within the tile.

    A column exists once it has been written. `activation_cycle` is int32, as the columns are.
    """

    def __init__(self) -> None:
        self.columns: dict[PlaceColumn, Column] = {}
        self.activation_cycle: npt.NDArray[np.int32] | None = None

    def column(self, name: PlaceColumn) -> Column:
        """Return a column to be written."""
        column = self.columns.get(name)
        if column is not None:
            return column

        column = np.full(_SHAPE, DEFAULTS[name], np.float32)
        self.columns[name] = column
        return column

    def value(self, name: PlaceColumn, i: int, j: int) -> float:
        """Return one cell's value in a column."""
        column = self.columns.get(name)
        if column is None:
            return DEFAULTS[name]
        return float(column[i, j])

    def set_activation(self, where: tuple[Indices, Indices], cycle: int) -> None:
        """Note that the activation of some cells is as of `cycle`."""
        if self.activation_cycle is None:
            self.activation_cycle = np.zeros(_SHAPE, np.int32)
        self.activation_cycle[where] = cycle

    def activation(self, cycle: int, decay: float) -> Column:
        """Return the activation of all cells in `cycle`, having decayed linearly by `decay` a
        cycle.
        """
        column = self.columns.get(PlaceColumn.ACTIVATION)
        if column is None or self.activation_cycle is None:
            return np.zeros(_SHAPE, np.float32)

        age = np.maximum(cycle - self.activation_cycle, 0)
        decayed = column - decay * age
        now: Column = np.maximum(decayed, 0.0).astype(np.float32)
        return now


class PlaceGrid:
    """The place nodes of all maps; a map's tiles come into being as their cells are written."""

    def __init__(self) -> None:
        self.tiles: dict[TileKey, Tile] = {}

    def put_cells(self, cells: Cells) -> None:
        """Write one column of some cells. Raises MessageError if their arrays do not fit."""
        where = cells.cells.numpy().astype(np.int64)
        values = cells.values.numpy().astype(np.float32)
        if where.ndim != 2 or where.shape != (values.size, 2):
            raise MessageError(f"{where.shape} cells of {cells.column} with {values.shape} values")

        for (x, y), chosen in by_tile(where):
            rows, columns = where[chosen].T % TILE_SIDE
            key = (cells.map, x, y)
            tile = self.tiles.get(key)
            if tile is None:
                tile = self.tiles[key] = Tile()

            column = tile.column(cells.column)
            column[rows, columns] = values[chosen]
            if cells.column is PlaceColumn.ACTIVATION:
                tile.set_activation((rows, columns), cells.cycle)

    def put_tile(self, message: PlaceTile) -> None:
        """Write a whole tile. Raises MessageError if a column is of another shape."""
        tile = Tile()
        for name, array in message.columns.items():
            values = _square(name, array)
            tile.columns[name] = np.array(values, np.float32)

        if message.activation_cycle is not None:
            cycles = _square("activation_cycle", message.activation_cycle)
            tile.activation_cycle = np.array(cycles, np.int32)

        self.tiles[message.map, message.x, message.y] = tile

    def messages(self) -> Iterator[PlaceTile]:
        """Yield all tiles, in order of map and position."""
        for key in sorted(self.tiles):
            yield self.message(key)

    def message(self, key: TileKey) -> PlaceTile:
        """Return one tile as it travels. Its arrays share memory with the tile: encode it
        at once.
        """
        map_id, x, y = key
        tile = self.tiles[key]
        columns = {name: Array.of(tile.columns[name]) for name in sorted(tile.columns)}
        cycles = None
        if tile.activation_cycle is not None:
            cycles = Array.of(tile.activation_cycle)

        return PlaceTile(
            map=map_id,
            x=x,
            y=y,
            columns=columns,
            activation_cycle=cycles,
        )

    def of_map(self, map_id: str) -> Iterator[tuple[TileKey, Tile]]:
        """Yield the tiles of one map, in order of position."""
        for key in sorted(self.tiles):
            if key[0] == map_id:
                yield key, self.tiles[key]

    def written_cells(self, map_id: str, column: PlaceColumn) -> tuple[Indices, Floats]:
        """Return the cells of a map whose value in a column is not 0, (k, 2), and the
        values, (k,).
        """
        cells = [np.zeros((0, 2), np.int64)]
        values = [np.zeros(0)]
        for (_, x, y), tile in self.of_map(map_id):
            written = tile.columns.get(column)
            if written is None:
                continue

            i, j = np.nonzero(written)
            map_i = i + x * TILE_SIDE
            map_j = j + y * TILE_SIDE
            cells.append(np.column_stack([map_i, map_j]))
            values.append(written[i, j].astype(np.float64))

        return np.vstack(cells), np.concatenate(values)

    def extent(self, map_id: str) -> Extent:
        """Return the smallest rectangle with all tiles of a map; an empty one if it has none."""
        tiles = [(x, y) for name, x, y in self.tiles if name == map_id]
        if not tiles:
            return Extent((0, 0), (0, 0))

        corners = np.array(tiles) * TILE_SIDE
        first_i, first_j = corners.min(axis=0).tolist()
        last_i, last_j = corners.max(axis=0).tolist()
        return Extent((first_i, first_j), (last_i + TILE_SIDE, last_j + TILE_SIDE))

    def window(
        self, map_id: str, columns: Iterable[PlaceColumn], extent: Extent | None = None
    ) -> Window:
        """Return some columns of a map's cells in `extent`, of all its tiles if that is not
        given.

        Raises MessageError if those are more than MAX_WINDOW_CELLS cells.
        """
        names = tuple(columns)
        wanted = self.extent(map_id) if extent is None else extent
        width, height = wanted.shape
        if width * height > MAX_WINDOW_CELLS:
            raise MessageError(
                f"{width} x {height} cells of {map_id} at once: ask for a part of the map"
            )

        values = np.empty((len(names), width, height), np.float32)
        for column, name in zip(values, names, strict=True):
            column.fill(DEFAULTS[name])

        for x, y in positions_in(wanted):
            tile = self.tiles.get((map_id, x, y))
            if tile is None:
                continue
            inside, within = overlap(x, y, wanted)
            for column, name in zip(values, names, strict=True):
                known = tile.columns.get(name)
                if known is not None:
                    column[within] = known[inside]

        return Window(wanted.lower, names, values)

    def value(self, map_id: str, i: int, j: int, column: PlaceColumn) -> float | None:
        """Return one cell's value in a column; None if its tile does not exist."""
        x, row = divmod(i, TILE_SIDE)
        y, line = divmod(j, TILE_SIDE)
        tile = self.tiles.get((map_id, x, y))
        if tile is None:
            return None
        return tile.value(column, row, line)

    def place(
        self, map_id: str, i: int, j: int, *, cell_m: float, cycle: int, decay: float
    ) -> Place | None:
        """Return one place node as of `cycle`; None if its tile does not exist."""
        x, row = divmod(i, TILE_SIDE)
        y, line = divmod(j, TILE_SIDE)
        tile = self.tiles.get((map_id, x, y))
        if tile is None:
            return None

        activation = tile.activation(cycle, decay)
        return Place(
            id=place_id(i, j, map_id),
            x_m=i * cell_m,
            y_m=j * cell_m,
            activation=float(activation[row, line]),
            road=tile.value(PlaceColumn.ROAD, row, line),
            obstacle=tile.value(PlaceColumn.OBSTACLE, row, line),
        )

    def links(self, map_id: str, i: int, j: int) -> Iterator[Link]:
        """Yield the links from a place node to those of its eight neighbours that exist, by
        direction.
        """
        here = place_id(i, j, map_id)
        for (di, dj), column in zip(LINK_OFFSETS.tolist(), WEIGHT_COLUMNS, strict=True):
            forth = self.value(map_id, i, j, column)
            if forth is None:
                continue

            ahead = self.value(map_id, i + di, j + dj, column)
            if ahead is not None:
                there = place_id(i + di, j + dj, map_id)
                yield Link(source=here, target=there, kind=LinkKind.NEXT, weight=forth)

            back = self.value(map_id, i - di, j - dj, column)
            if back is not None:
                there = place_id(i - di, j - dj, map_id)
                yield Link(source=here, target=there, kind=LinkKind.NEXT, weight=back)

    def drop_map(self, map_id: str) -> None:
        """Remove all place nodes of a map."""
        for key in [key for key in self.tiles if key[0] == map_id]:
            del self.tiles[key]

    def clear(self) -> None:
        """Remove all place nodes."""
        self.tiles.clear()


def _square(name: str, array: Array) -> npt.NDArray[np.generic]:
    if array.shape != _SHAPE:
        raise MessageError(f"tile column {name} of shape {array.shape}, not {_SHAPE}")
    return array.numpy()
