"""Episodes as single vectors: what, where and by which places. Pure."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Bytes
from cogmap.schemas.memory import StoredEpisode
from cogmap.services.memory.sparse.structures import ItemMemory, encode_sequence
from cogmap.services.memory.sparse.vectors import bind, bundle

WHERE = "where"
PATH = "path"
PLACE_M = 10.0
"""Distance from where an episode began at which the next one begins."""

CELL_M = 2 * PLACE_M
"""The side of the cells that stand for places."""


def encoded(episode: StoredEpisode, items: ItemMemory) -> Bytes:
    """Encode an episode as a vector.

    It is the bundle of the episode's content, of its place, and of its path, a sequence with the
    last place first, each bound to its role, and all to the place and its map. What looks alike
    elsewhere is thus unrelated: else memory would complete every cue to what is usual in a town.
    """
    here = _cell((episode.x_m, episode.y_m))
    return bind(_content(episode, items), _place(here, episode, items), items.values)


def cues(episode: StoredEpisode, items: ItemMemory) -> list[Bytes]:
    """Return the vectors of an episode as it would be at the cells within half of PLACE_M."""
    content = _content(episode, items)
    cells: dict[str, None] = {}
    for dx_m in (0.0, -PLACE_M / 2, PLACE_M / 2):
        for dy_m in (0.0, -PLACE_M / 2, PLACE_M / 2):
            cells[_cell((episode.x_m + dx_m, episode.y_m + dy_m))] = None

    return [bind(content, _place(here, episode, items), items.values) for here in cells]


def squares(episode: StoredEpisode) -> list[str]:
    """Return the squares that stand for its places in the vector of an episode, on its map."""
    places_m = [(episode.x_m, episode.y_m), *episode.path]
    return [episode.map, *(_cell(at_m) for at_m in places_m)]


def _cell(at_m: tuple[float, float]) -> str:
    """Name the square that stands for the places in it."""
    x_m, y_m = at_m
    return f"{math.floor(x_m / CELL_M)} {math.floor(y_m / CELL_M)}"


def _content(episode: StoredEpisode, items: ItemMemory) -> Bytes:
    parts = [items.filled(node.kind, node.label) for node in episode.content]
    parts.append(items.role(WHERE))
    if episode.path:
        path = [_cell(at_m) for at_m in episode.path]
        parts.append(bind(items.role(PATH), encode_sequence(items, path), items.values))

    return bundle(np.stack(parts), items.values)


def _place(here: str, episode: StoredEpisode, items: ItemMemory) -> Bytes:
    return bind(items.item(here), items.item(episode.map), items.values)
