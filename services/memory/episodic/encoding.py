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
CELLS = 2.0
"""The side of the cells that stand for places, in distances between episodes."""


def encoded(episode: StoredEpisode, items: ItemMemory, place_m: float) -> Bytes:
    """The vector of an episode, whose places are `place_m` apart.

    It is the bundle of the episode's content, of its place, and of its path, a sequence with the
    last place first, each bound to its role, and all to the place and its map. What looks alike
    elsewhere is so unrelated: else memory would complete every cue to what is usual in a town.
    """
    here = _cell((episode.x_m, episode.y_m), place_m)
    return bind(_content(episode, items, place_m), _place(here, episode, items), items.values)


def cues(episode: StoredEpisode, items: ItemMemory, place_m: float) -> list[Bytes]:
    """The vectors of an episode as it would be at the cells within half of `place_m`."""
    content = _content(episode, items, place_m)
    cells: dict[str, None] = {}
    for dx_m in (0.0, -place_m / 2, place_m / 2):
        for dy_m in (0.0, -place_m / 2, place_m / 2):
            cells[_cell((episode.x_m + dx_m, episode.y_m + dy_m), place_m)] = None

    return [bind(content, _place(here, episode, items), items.values) for here in cells]


def squares(episode: StoredEpisode, place_m: float) -> list[str]:
    """The squares that stand for its places in the vector of an episode, on its map."""
    places_m = [(episode.x_m, episode.y_m), *episode.path]
    return [episode.map, *(_cell(at_m, place_m) for at_m in places_m)]


def _cell(at_m: tuple[float, float], place_m: float) -> str:
    """The name of the square that stands for the places in it."""
    x_m, y_m = at_m
    side_m = CELLS * place_m
    return f"{math.floor(x_m / side_m)} {math.floor(y_m / side_m)}"


def _content(episode: StoredEpisode, items: ItemMemory, place_m: float) -> Bytes:
    parts = [items.filled(node.kind, node.label) for node in episode.content]
    parts.append(items.role(WHERE))
    if episode.path:
        path = [_cell(at_m, place_m) for at_m in episode.path]
        parts.append(bind(items.role(PATH), encode_sequence(items, path), items.values))

    return bundle(np.stack(parts), items.values)


def _place(here: str, episode: StoredEpisode, items: ItemMemory) -> Bytes:
    return bind(items.item(here), items.item(episode.map), items.values)
