"""Which stored map the agent is on: where the objects known here stand as they do. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import transform_from
from cogmap.schemas.nodes import TILE_SIDE, Object, look_of
from cogmap.services.memory.config import Config
from cogmap.services.memory.maps import RememberedMap
from cogmap.services.memory.matching import NOWHERE, Landmarks, Match, best_matches
from cogmap.services.memory.passing import Way, is_as_passed

MAX_CUES = 24
"""So many objects, the nearest to the agent, cue a recall."""


class Recalled(NamedTuple):
    """A stored map, where this one lies on it, and the label here of each of its objects, empty of
    those that are not known here.
    """

    remembered: RememberedMap
    pose: Floats
    matched: list[str]


class _Compared(NamedTuple):
    """A stored map, how the objects here match it, and how many do at any other pose."""

    remembered: RememberedMap
    match: Match
    runner_up: int


def cues(learned: Iterable[Object], agent_m: tuple[float, float]) -> list[Object]:
    """The objects that cue a recall: the nearest to the agent."""

    def order(node: Object) -> tuple[float, str]:
        return math.dist((node.x_m, node.y_m), agent_m), node.id

    return sorted(learned, key=order)[:MAX_CUES]


def recalled(
    here: Sequence[Object],
    way: Way,
    stored: Sequence[RememberedMap],
    cell_m: float,
    config: Config,
) -> Recalled | None:
    """The one of some stored maps that objects `here`, at the end of a way, are on; None where that
    is not sure.
    """
    if len(here) < config.min_matches:
        return None

    compared = []
    for remembered in stored:
        found = _compared(here, remembered, config)
        if found is not None:
            compared.append(found)
    if not compared:
        return None

    compared.sort(key=lambda each: -each.match.matched)
    best, *others = compared
    runner_up = max([best.runner_up, *(other.match.matched for other in others)])
    is_sure = _is_sure(here, best, runner_up, cell_m, config)
    if not is_sure or not _is_distinctive(here, way, best, config):
        return None

    return Recalled(best.remembered, best.match.pose, _labels(here, best))


def _compared(
    here: Sequence[Object], remembered: RememberedMap, config: Config
) -> _Compared | None:
    """How the objects here match one stored map; None where nothing does."""
    looks_there = remembered.looks
    number = {look: index for index, look in enumerate(sorted(set(looks_there)))}
    looks_here = [number.get(look_of(node.label), NOWHERE) for node in here]

    found = best_matches(
        Landmarks(np.array(looks_here), np.array([(node.x_m, node.y_m) for node in here])),
        Landmarks(np.array([number[look] for look in looks_there]), remembered.at_m),
        config.match_within_m,
    )
    if found is None:
        return None

    match, runner_up = found
    return _Compared(remembered, match, runner_up)


def _is_sure(
    here: Sequence[Object], best: _Compared, runner_up: int, cell_m: float, config: Config
) -> bool:
    """Whether the best match is of enough objects, of those that it could be of, and leads any
    other.
    """
    count = best.match.matched
    if count < config.min_matches or count - runner_up < config.min_lead:
        return False

    is_matched = best.match.there != NOWHERE
    at_m = transform_from(best.match.pose, np.array([(node.x_m, node.y_m) for node in here]))
    could_match = is_matched | _is_known(best.remembered, at_m, cell_m)
    return bool(count >= config.min_share * could_match.sum())


def _is_distinctive(here: Sequence[Object], way: Way, best: _Compared, config: Config) -> bool:
    """Whether the objects that match have several looks among them, or few, and the stored map has
    along the way what was passed.
    """
    matched = np.flatnonzero(best.match.there != NOWHERE).tolist()
    looks = {look_of(here[number].label) for number in matched}
    if len(looks) >= config.min_looks:
        return True
    if len(looks) < config.min_looks_passed:
        return False
    return is_as_passed(way, best.remembered, best.match.pose, config)


def _is_known(remembered: RememberedMap, at_m: Floats, cell_m: float) -> Booleans:
    """(n,): whether positions (n, 2) are on squares of a stored map that are known."""
    tiles: Indices = np.floor(np.rint(at_m / cell_m) / TILE_SIDE).astype(np.int64)
    known = [(x, y) in remembered.tiles for x, y in tiles.tolist()]
    return np.array(known, bool)


def _labels(here: Sequence[Object], best: _Compared) -> list[str]:
    """The labels here of all objects of the stored map."""
    labels = [""] * len(best.remembered.looks)
    for number, there in enumerate(best.match.there.tolist()):
        if there != NOWHERE:
            labels[there] = here[number].label

    return labels
