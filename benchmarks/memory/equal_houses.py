"""The distance driven between equal houses before a map is recalled, and recalls of another town's.

A town is a grid of streets with houses of two looks, evenly spaced, one in ten of them missing. A
first walk along its streets, in a frame of its own, gives the map; a second one recalls it, or has
the maps of the other towns alone. Nothing is simulated but the noise of each house's position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.report import Metrics
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import relative, transform_to
from cogmap.schemas.array import Matrix
from cogmap.schemas.memory import StoredObjects
from cogmap.schemas.nodes import TILE_SIDE, Object, individual_label, object_id
from cogmap.services.memory.public import RememberedMap, Way, recall

TOWNS = 4
CROSSINGS = 4
BLOCK_M = (48.0, 72.0)
SPACING_M = 12.0
CORNER_M = 14.0
BESIDE_M = 10.0
VACANT_SHARE = 0.1
OF_ONE_LOOK = 0.8
SEEN_M = 35.0
NOISE_M = 0.4
LEARN_BLOCKS = 12
RECALL_BLOCKS = 4
EVERY_M = 20
WAY_M = 130
SIGHTINGS = 9
RIGHT_WITHIN_M = 4.0
RIGHT_WITHIN_RAD = 0.1


class Walk(NamedTuple):
    """Places 1 m apart, (k, 2), and the houses seen along it: their looks, positions (n, 2) and the
    distance driven before each is seen, (n,); all in the walk's own frame, whose pose in the town
    is `frame`.
    """

    frame: Floats
    way_m: Floats
    looks: list[str]
    at_m: Floats
    after_m: Floats

    def objects(self, driven_m: int) -> list[Object]:
        """Return the houses known once so much was driven."""
        nodes = []
        for number in np.flatnonzero(self.after_m <= driven_m).tolist():
            label = individual_label(1 + number, 0)
            names = {self.looks[number]: 1.0}
            x_m, y_m = self.at_m[number].tolist()
            nodes.append(
                Object(
                    id=object_id(label),
                    label=label,
                    names=names,
                    x_m=x_m,
                    y_m=y_m,
                    sightings=SIGHTINGS,
                )
            )

        return nodes


def measure(seed: int, towns: int = TOWNS) -> Metrics:
    """Return the distance driven before a town's own map is recalled and right, the whole walk if
    it is not; the share of the towns in which it is; and how many maps are recalled wrongly, of the
    town's own or of the others'.
    """
    walks = []
    maps = []
    for number in range(towns):
        rng = np.random.default_rng([seed, number, 0xE0])
        lines_m = rng.uniform(*BLOCK_M, (2, CROSSINGS)).cumsum(axis=1)
        looks, at_m = _houses(rng, lines_m)
        first = _walk(rng, lines_m, LEARN_BLOCKS, looks, at_m)
        walks.append((first, _walk(rng, lines_m, RECALL_BLOCKS, looks, at_m)))
        maps.append(_learned(f"town-{number}", first))

    ways_m: list[int] = []
    are_right = []
    wrong = 0
    for number, (first, second) in enumerate(walks):
        way_m, own = recalled_after(second, [maps[number]])
        is_own_right = own is not None and is_right(own, first, second)
        ways_m.append(way_m if is_own_right else len(second.way_m))
        are_right.append(is_own_right)

        _, strange = recalled_after(second, maps[:number] + maps[number + 1 :])
        wrong += strange is not None
        wrong += own is not None and not is_own_right

    return {
        "equal_houses_driven_m": float(np.mean(ways_m)),
        "equal_houses_recalled": float(np.mean(are_right)),
        "equal_houses_wrong": float(wrong),
    }


def recalled_after(walk: Walk, stored: Sequence[RememberedMap]) -> tuple[int, Floats | None]:
    """Return the distance driven, in m, before one of some maps is recalled, and the pose of the
    walk's frame in the map's; None if none is.
    """
    for driven_m in range(EVERY_M, len(walk.way_m), EVERY_M):
        known = walk.objects(driven_m)
        x_m, y_m = walk.way_m[driven_m].tolist()
        way = Way(walk.way_m[max(0, driven_m - WAY_M) : driven_m], known)
        found = recall.recalled(recall.cues(known, (x_m, y_m)), way, stored, 1.0)
        if found is not None:
            return driven_m, found.pose

    return len(walk.way_m), None


def is_right(pose: Floats, first: Walk, second: Walk) -> bool:
    """Decide whether that is the pose of the second walk's frame in that of the first one."""
    x_m, y_m, turn_rad = relative(relative(first.frame, second.frame), pose).tolist()
    return math.hypot(x_m, y_m) <= RIGHT_WITHIN_M and abs(turn_rad) <= RIGHT_WITHIN_RAD


def _houses(rng: np.random.Generator, lines_m: Floats) -> tuple[list[str], Floats]:
    """Draw houses on both sides of each block of the streets, of mostly one look on each side."""
    looks: list[str] = []
    at_m: list[Floats] = []
    for axis in (0, 1):
        for across_m in lines_m[1 - axis].tolist():
            for start_m, end_m in zip(lines_m[axis, :-1], lines_m[axis, 1:], strict=True):
                for side_m in (-BESIDE_M, BESIDE_M):
                    along_m = np.arange(start_m + CORNER_M, end_m - CORNER_M, SPACING_M)
                    along_m = along_m[rng.random(len(along_m)) >= VACANT_SHARE]
                    usual, other = rng.permutation(["house", "works"]).tolist()
                    is_usual = rng.random(len(along_m)) < OF_ONE_LOOK
                    looks += [usual if each else other for each in is_usual.tolist()]
                    row = np.column_stack([along_m, np.full(len(along_m), across_m + side_m)])
                    at_m.append(row if axis == 0 else row[:, ::-1])

    return looks, np.vstack(at_m)


def _walk(
    rng: np.random.Generator, lines_m: Floats, blocks: int, looks: list[str], at_m: Floats
) -> Walk:
    """Draw a walk at random that turns back only at the border, seen from a frame of its own."""
    way_m = _way(rng, lines_m, blocks)
    away_m = np.hypot(*(at_m[:, None] - way_m).transpose(2, 0, 1))
    is_seen = away_m.min(axis=1) <= SEEN_M
    after_m = (away_m <= SEEN_M).argmax(axis=1)[is_seen]

    frame = np.array([*way_m[0], rng.uniform(-np.pi, np.pi)])
    taken_m = at_m[is_seen] + rng.normal(0.0, NOISE_M, (int(is_seen.sum()), 2))
    seen = [looks[number] for number in np.flatnonzero(is_seen).tolist()]
    return Walk(frame, transform_to(frame, way_m), seen, transform_to(frame, taken_m), after_m)


def _way(rng: np.random.Generator, lines_m: Floats, blocks: int) -> Floats:
    """Draw (k, 2) places 1 m apart from crossing to crossing."""
    here = rng.integers(0, CROSSINGS, 2)
    before = here
    places_m = [np.array([[lines_m[0, here[0]], lines_m[1, here[1]]]])]
    for _ in range(blocks):
        steps = [here + step for step in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        inside = [step for step in steps if step.min() >= 0 and step.max() < CROSSINGS]
        ahead = [step for step in inside if (step != before).any()]
        before, here = here, ahead[int(rng.integers(len(ahead)))]

        start_m = places_m[-1][-1]
        end_m = np.array([lines_m[0, here[0]], lines_m[1, here[1]]])
        count = int(np.hypot(*(end_m - start_m)))
        places_m.append(start_m + np.linspace(0, 1, count + 1)[1:, None] * (end_m - start_m))

    return np.vstack(places_m)


def _learned(name: str, walk: Walk) -> RememberedMap:
    """Return the map that a walk stored."""
    rows = np.zeros((len(walk.looks), 7))
    rows[:, :2] = walk.at_m
    houses = walk.objects(len(walk.way_m))
    known = StoredObjects(
        map=name,
        cell_m=1.0,
        labels=[node.label for node in houses],
        names=[node.look for node in houses],
        given_names=[""] * len(houses),
        functions=[""] * len(houses),
        objects=Matrix.of(rows),
    )
    squares = np.floor(walk.way_m / TILE_SIDE).astype(np.int64)
    return RememberedMap(name, known, tiles={(x, y): {} for x, y in squares.tolist()})
