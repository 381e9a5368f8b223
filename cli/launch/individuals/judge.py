"""Judges the objects of a map by the buildings that their percepts show. Pure."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from cogmap.cli.launch.individuals.buildings import NOTHING, Buildings
from cogmap.cli.launch.individuals.percepts import PerceptTally, Sight
from cogmap.geometry.arrays import Floats, Indices
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import SATISFIED_BY, Object
from cogmap.schemas.sensing import TrueTown

SEEN_VIEWS = 10
RIGHT_M = 3.0


class BuildingMetrics(msgspec.Struct, kw_only=True):
    """How true the buildings on the map are.

    `seen` are the buildings that percepts of SEEN_VIEWS views or more show, and `on_map` the
    objects that stand for them, or for no building; `missing` of the buildings have none, `doubled`
    ones several. `right` of the objects stand within RIGHT_M of the centre of the building that
    most of their percepts show; `error_median_m` is of those that show one, None without any.
    `strays` show none. `glimpsed` are further objects, of buildings seen in fewer views. Of
    `percepts`, `given` were given to an object, and `pure` to one most of whose percepts show the
    same building.
    """

    seen: int
    on_map: int
    right: int
    error_median_m: float | None
    missing: int
    doubled: int
    strays: int
    glimpsed: int
    percepts: int
    given: int
    pure: int


@dataclass(frozen=True)
class Individual:
    """An object of the map: the number of the building that most of its percepts show, NOTHING if
    most show none, and how many do; where it stands in the world, and how far that is from the
    building's centre, NaN without one.
    """

    node: Object
    building: int
    percepts: int
    at_m: tuple[float, float]
    error_m: float


@dataclass(frozen=True)
class Judgement:
    """The town's `buildings`, in how many views percepts show each, (n,), the individuals on the
    map, by id, how many percepts there were, and how many were given to an object, and to one of
    their building.
    """

    buildings: Buildings
    views: Indices
    individuals: list[Individual]
    percepts: int
    given: int
    pure: int

    @property
    def seen(self) -> list[int]:
        """Return the numbers of the buildings that were seen in SEEN_VIEWS views or more."""
        numbers: list[int] = np.flatnonzero(self.views >= SEEN_VIEWS).tolist()
        return numbers

    def of(self, building: int) -> list[Individual]:
        """Return the individuals of a building, the one with most percepts first."""
        found = [each for each in self.individuals if each.building == building]
        return sorted(found, key=lambda each: (-each.percepts, each.node.id))

    def metrics(self) -> BuildingMetrics:
        """Count the buildings seen and those on the map."""
        seen = set(self.seen)
        counted = [each for each in self.individuals if each.building in {*seen, NOTHING}]
        errors_m = [each.error_m for each in counted if each.building != NOTHING]
        shown = Counter(each.building for each in counted)
        return BuildingMetrics(
            seen=len(seen),
            on_map=len(counted),
            right=sum(error_m <= RIGHT_M for error_m in errors_m),
            error_median_m=float(np.median(errors_m)) if errors_m else None,
            missing=len(seen - shown.keys()),
            doubled=sum(shown[building] > 1 for building in seen),
            strays=sum(each.building == NOTHING for each in counted),
            glimpsed=len(self.individuals) - len(counted),
            percepts=self.percepts,
            given=self.given,
            pure=self.pure,
        )


def judge(
    tally: PerceptTally, town: TrueTown, graph: Graph, to_world: Callable[[Floats], Floats]
) -> Judgement:
    """Judge the objects of the map `graph`, whose frame `to_world` transforms points (n, 2) from.

    An object that no percept of the drive was given to is not judged: it is of an earlier drive.
    Neither are places to charge at, which are no buildings.
    """
    buildings = Buildings(town)
    views: defaultdict[int, set[int]] = defaultdict(set)
    for sight, building in _shown(tally, tally.seen, buildings):
        if building != NOTHING:
            views[building].add(sight.stamp_ns)

    charging = {node.id for node in graph.of_kind(Object) if node.function in SATISFIED_BY.values()}
    given: defaultdict[str, list[int]] = defaultdict(list)
    for sight, building in _shown(tally, tally.entered, buildings):
        if sight.object and sight.object not in charging:
            given[sight.object].append(building)

    mostly = {name: _mostly(numbers) for name, numbers in given.items()}
    pure = sum(
        number == mostly[name] != NOTHING for name, numbers in given.items() for number in numbers
    )
    individuals = []
    for node in sorted(graph.of_kind(Object), key=lambda each: each.id):
        if node.id not in given:
            continue

        ((x_m, y_m),) = to_world(np.array([[node.x_m, node.y_m]])).tolist()
        building = mostly[node.id]
        error_m = float("nan")
        if building != NOTHING:
            error_m = float(np.hypot(*(buildings.centres_m[building] - (x_m, y_m))))
        individuals.append(
            Individual(node, building, given[node.id].count(building), (x_m, y_m), error_m)
        )

    return Judgement(
        buildings=buildings,
        views=np.array([len(views[number]) for number in range(len(buildings.names))], np.int64),
        individuals=individuals,
        percepts=len(tally.seen),
        given=sum(len(numbers) for numbers in given.values()),
        pure=pure,
    )


def _shown(
    tally: PerceptTally, sights: Sequence[Sight], buildings: Buildings
) -> list[tuple[Sight, int]]:
    """Return each of the sights from a known pose with the building that it shows."""
    shown = []
    for sight, pose in zip(sights, tally.true_poses(sights), strict=True):
        if np.isfinite(pose).all():
            place = (sight.bearing_rad, sight.range_m)
            building = buildings.shown_by(pose, place, sight.outline_px, sight.calibration)
            shown.append((sight, building))

    return shown


def _mostly(numbers: Iterable[int]) -> int:
    """Return the commonest number, of equally common ones the one that came first."""
    ((number, _),) = Counter(numbers).most_common(1)
    return number
