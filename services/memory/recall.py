"""Which stored map the agent is on: where the objects known here stand as they do. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.schemas.nodes import TILE_SIDE, Object
from cogmap.services.memory.maps import RememberedMap
from cogmap.services.memory.matching import NOWHERE, Landmarks, best_matches
from cogmap.services.memory.sequence_cue import MATCH_WITHIN_M, MIN_SHARE, Way, is_as_passed

MAX_CUES = 24
"""So many objects, the nearest to the agent, cue a recall."""

# Chosen on second runs in towns of blocks, and on equal houses (`benchmarks memory`).
MIN_MATCHES = 6
"""Objects that must stand as on a stored map."""

MIN_LEAD = 3
"""By how many matches the best position on all stored maps must lead any other."""

MIN_LOOKS = 3
"""Looks that these objects must have among them: rows of equal houses are alike in every town."""

MIN_LOOKS_PASSED = 2
"""Looks that are enough if the stored map has along the way what was passed."""


class Recalled(NamedTuple):
    """A stored map, where this one lies on it, and the label here of each of its objects, empty of
    those that are not known here.
    """

    remembered: RememberedMap
    pose: Floats
    matched: list[str]


def cues(learned: Iterable[Object], agent_m: tuple[float, float]) -> list[Object]:
    """Return the objects that cue a recall: the nearest to the agent."""

    def order(node: Object) -> tuple[float, str]:
        return math.dist((node.x_m, node.y_m), agent_m), node.id

    return sorted(learned, key=order)[:MAX_CUES]


def recalled(
    here: Sequence[Object], way: Way, stored: Sequence[RememberedMap], cell_m: float
) -> Recalled | None:
    """Find the one of some stored maps that objects `here`, at the end of a way, are on; None if
    that is not sure.
    """
    if len(here) < MIN_MATCHES:
        return None

    here_m = np.array([(node.x_m, node.y_m) for node in here])
    compared = []
    for remembered in stored:
        number = {look: index for index, look in enumerate(sorted(set(remembered.looks)))}
        looks_here = [number.get(node.look, NOWHERE) for node in here]
        looks_there = [number[look] for look in remembered.looks]
        found = best_matches(
            Landmarks(np.array(looks_here), here_m),
            Landmarks(np.array(looks_there), remembered.at_m),
            MATCH_WITHIN_M,
        )
        if found is not None:
            compared.append((remembered, *found))
    if not compared:
        return None

    # The best match is of enough objects, and leads any other.
    compared.sort(key=lambda each: -each[1].matched)
    (best, match, same_map), *others = compared
    runner_up = max([same_map, *(other.matched for _, other, _ in others)])
    if match.matched < MIN_MATCHES or match.matched - runner_up < MIN_LEAD:
        return None

    # Most of what could match does: what stands on squares of the stored map that are known.
    is_matched = match.there != NOWHERE
    squares = np.floor(np.rint(transform_from(match.pose, here_m) / cell_m) / TILE_SIDE)
    is_known = [(x, y) in best.tiles for x, y in squares.astype(np.int64).tolist()]
    could_match = is_matched | np.array(is_known, bool)
    if match.matched < MIN_SHARE * could_match.sum():
        return None

    # It has several looks, or few, and the stored map has along the way what was passed.
    labels = [""] * len(best.looks)
    looks = set()
    for number_here, there in enumerate(match.there.tolist()):
        if there != NOWHERE:
            labels[there] = here[number_here].label
            looks.add(here[number_here].look)
    has_few = len(looks) < MIN_LOOKS_PASSED
    if has_few or (len(looks) < MIN_LOOKS and not is_as_passed(way, best, match.pose)):
        return None

    return Recalled(best, match.pose, labels)
