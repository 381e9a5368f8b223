from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.geometry.se2 import transform_to
from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP, REAL_TIME, Run
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Broadcast, Coalition, Competition, Trigger
from cogmap.schemas.graph import Cells, Delta, Link, Operation, Phase
from cogmap.schemas.memory import Restored, Stored, StoredObjects, StoredTile, StoredTree
from cogmap.schemas.nodes import (
    RECOLLECTION_ID,
    ROOT_MAP,
    LinkKind,
    Map,
    Object,
    PathColumn,
    PathSegment,
    PlaceColumn,
    Recollection,
    individual_label,
    map_id,
    object_id,
    segment_id,
)
from cogmap.schemas.sensing import RangeScan
from cogmap.services.memory.module import Config, build
from cogmap.testing import agent, landmark, of_type

CONFIG = Config(store_cycles=2, recall_cycles=1)
LOOKS = ("bakery", "tower", "house", "school")
POSE = np.array([30.0, -10.0, 0.7])
AT_M = np.random.default_rng(7).uniform(-60, 60, (12, 2))


def buildings(at_m: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> list[Operation]:
    """Buildings of several looks that were seen often."""
    nodes: list[Operation] = []
    for number, at in enumerate(at_m.tolist()):
        label = individual_label(41, number)
        names = {LOOKS[number % 4]: 9.0}
        nodes.append(landmark(label, [at], names=names, sightings=9))

    return nodes


def houses() -> list[Operation]:
    """Houses of two looks on both sides of a street along x."""
    nodes: list[Operation] = []
    for number, x_m in enumerate((8.0, 17.0, 31.0, 38.0, 52.0, 63.0, 74.0, 88.0), start=1):
        names = {"works" if number in (3, 5) else "house": 9.0}
        y_m = 9.0 * (-1.0) ** number
        nodes.append(landmark(individual_label(number, 0), [(x_m, y_m)], names=names, sightings=9))

    return nodes


def road(cell: tuple[int, int] = (3, 4)) -> Cells:
    """A place node that is road."""
    return Cells(
        map=ROOT_MAP,
        column=PlaceColumn.ROAD,
        cells=Array.of(np.array([cell]), "<i4"),
        values=Array.of(np.array([0.75]), "<f4"),
    )


def district(*labels: str) -> list[Operation]:
    """A sub-map with some of the buildings in it."""
    links: list[Operation] = []
    for label in labels:
        link = Link(source=object_id(label), target=map_id(4), kind=LinkKind.WITHIN)
        links.append(link)

    return [Map(id=map_id(4), parent=ROOT_MAP, cell_m=0.5, width_m=30.0, height_m=20.0), *links]


class Mind:
    """Long-term memory, and what the others publish for it."""

    def __init__(
        self, *operations: Operation, config: Config = CONFIG, run: Run = LOCKSTEP
    ) -> None:
        self.module: Module = build(config, "memory", run)
        self._version = 0
        self.commit(1, Map(id=ROOT_MAP, cell_m=1.0), agent(), *operations)

    def commit(self, cycle: int, *operations: Operation, phase: Phase = Phase.OBJECTS) -> None:
        """Commit operations, whose replies are not of interest."""
        assert self._commit(cycle, phase, *operations) == []

    def end(self, cycle: int) -> list[Message]:
        """End a cycle."""
        return self._commit(cycle, Phase.END)

    def compete(self, cycle: int, is_conscious: bool = True) -> list[Message]:
        """A cycle's competition, with a broadcast of the root map where it `is_conscious`."""
        if not is_conscious:
            return self.module.feed(Competition(cycle=cycle, contenders=[]))

        coalition = Coalition(codelet="whereabouts", activation=0.5, nodes=[], maps=[ROOT_MAP])
        broadcast = Broadcast(cycle=cycle, trigger=Trigger.AGGREGATE, coalition=coalition)
        competition = Competition(cycle=cycle, contenders=[], trigger=Trigger.AGGREGATE)
        return self.module.feed(broadcast) + self.module.feed(competition)

    def live(self, until: int) -> list[Message]:
        """Cycles from the first to `until`, in each of which the map is conscious."""
        published: list[Message] = []
        for cycle in range(1, until + 1):
            published += self.end(cycle)
            published += self.compete(cycle)

        return published

    def _commit(self, cycle: int, phase: Phase, *operations: Operation) -> list[Message]:
        self._version += 1
        delta = Delta(
            stamp_ns=cycle * 10**9,
            version=self._version,
            cycle=cycle,
            phase=phase,
            operations=list(operations),
        )
        return self.module.feed(delta)


def stored_in(published: list[Message]) -> Stored:
    """The one message of what was stored."""
    (stored,) = of_type(Stored, published)
    return stored


def learned_town() -> Restored:
    """What a first run in a town stored."""
    first = Mind(*buildings(AT_M), road())
    return Restored(records=stored_in(first.live(3)).records)


def recollections(published: list[Message]) -> list[Recollection]:
    """The maps that were offered."""
    offered = [operation for offer in of_type(Offer, published) for operation in offer.operations]
    return of_type(Recollection, offered)


def test_a_map_that_was_conscious_is_stored_with_its_objects_and_places() -> None:
    stored = stored_in(Mind(*buildings(AT_M), road()).live(3))

    (objects,) = of_type(StoredObjects, stored.records)
    (tile,) = of_type(StoredTile, stored.records)
    assert objects.map == tile.map == "remembered:1"
    assert sorted(objects.labels)[:2] == ["41a", "41b"]
    assert objects.names.count("bakery") == 3
    assert objects.objects.shape == (12, 7)
    assert tile.columns[PlaceColumn.ROAD].numpy()[0, 3 * 32 + 4] == 0.75


def test_the_sub_maps_of_a_map_are_stored_with_their_objects_and_recalled_with_it() -> None:
    first = Mind(*buildings(AT_M), *district("41a", "41b"))
    records = stored_in(first.live(3)).records
    (tree,) = of_type(StoredTree, records)
    assert [(each.number, each.parent) for each in tree.sub_maps] == [(4, 0)]
    assert tree.sub_maps[0].members == ["41a", "41b"]

    second = Mind(*buildings(transform_to(POSE, AT_M)))
    second.module.feed(Restored(records=records))

    (recalled,) = recollections(second.end(1) + second.compete(1))
    assert recalled.sub_maps == tree.sub_maps


def test_sub_maps_are_stored_again_where_an_object_has_changed_its_own() -> None:
    mind = Mind(*buildings(AT_M), *district("41a", "41b"))
    mind.live(3)
    mind.commit(4, *district("41d"))

    published: list[Message] = []
    for cycle in range(4, 8):
        published += mind.end(cycle) + mind.compete(cycle)

    (tree,) = stored_in(published).records
    assert isinstance(tree, StoredTree)
    assert tree.sub_maps[0].members == ["41a", "41b", "41d"]


def test_a_map_that_was_never_conscious_is_not_stored() -> None:
    mind = Mind(*buildings(AT_M))

    published: list[Message] = []
    for cycle in range(1, 6):
        published += mind.end(cycle) + mind.compete(cycle, is_conscious=False)

    assert of_type(Stored, published) == []


def test_only_what_has_changed_is_stored_again() -> None:
    mind = Mind(*buildings(AT_M), road())
    mind.live(3)
    mind.commit(4, road((40, 4)))

    published: list[Message] = []
    for cycle in range(4, 8):
        published += mind.end(cycle) + mind.compete(cycle)

    (record,) = stored_in(published).records
    assert isinstance(record, StoredTile)
    assert (record.x, record.y) == (1, 0)


def test_objects_that_were_seen_too_seldom_are_not_stored() -> None:
    stranger = Object(id="object:kiosk", label="kiosk", x_m=0.0, y_m=0.0, sightings=1)

    (objects,) = of_type(StoredObjects, stored_in(Mind(*buildings(AT_M), stranger).live(3)).records)

    assert "kiosk" not in objects.labels


def test_a_town_is_recalled_in_a_frame_of_its_own_with_the_relative_position() -> None:
    mind = Mind(*buildings(transform_to(POSE, AT_M)))
    mind.module.feed(learned_town())

    (recalled,) = recollections(mind.end(1) + mind.compete(1))

    assert recalled.id == RECOLLECTION_ID
    assert recalled.map == "remembered:1"
    assert (recalled.x_m, recalled.y_m, recalled.heading_rad) == pytest.approx(tuple(POSE))
    assert recalled.matched == recalled.labels
    assert recalled.tiles == [(0, 0)]


def test_a_street_of_two_looks_is_recalled_once_it_was_driven() -> None:
    path = np.zeros((100, len(PathColumn)))
    path[:, PathColumn.X_M] = np.arange(100.0)
    driven = PathSegment(id=segment_id(0), number=0, rows=Matrix.of(path))
    known = Restored(records=stored_in(Mind(*houses()).live(3)).records)

    passing = Mind(*houses(), driven)
    passing.module.feed(known)
    standing = Mind(*houses())
    standing.module.feed(known)

    (recalled,) = recollections(passing.end(1) + passing.compete(1))
    assert (recalled.x_m, recalled.y_m, recalled.heading_rad) == pytest.approx((0.0, 0.0, 0.0))
    assert recollections(standing.end(1) + standing.compete(1)) == []


def test_another_town_is_not_taken_for_the_one_that_is_known() -> None:
    elsewhere_m = np.random.default_rng(8).uniform(-60, 60, (12, 2))
    mind = Mind(*buildings(elsewhere_m))
    mind.module.feed(learned_town())

    assert recollections(mind.live(5)) == []


def test_few_objects_are_not_enough_to_recall_a_town() -> None:
    mind = Mind(*buildings(transform_to(POSE, AT_M[:5])))
    mind.module.feed(learned_town())

    assert recollections(mind.live(5)) == []


def test_a_joined_map_is_stored_under_its_old_name_and_the_new_one_is_forgotten() -> None:
    mind = Mind(*buildings(transform_to(POSE, AT_M)))
    mind.live(3)
    mind.module.feed(msgspec.structs.replace(learned_town(), records=_renamed("remembered:7")))
    mind.commit(4, Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:7"))

    published: list[Message] = []
    for cycle in range(4, 7):
        published += mind.end(cycle) + mind.compete(cycle)

    stored = stored_in(published)
    assert {record.map for record in stored.records} == {"remembered:7"}
    assert stored.forgotten == ["remembered:1/objects"]
    assert recollections(published) == []


def _renamed(name: str) -> list[StoredObjects | StoredTile]:
    return [msgspec.structs.replace(each, map=name) for each in learned_town().records]


def test_a_restart_continues_with_the_map_of_this_run() -> None:
    first = Mind(*buildings(AT_M), road())
    past = of_type(Stored, first.live(3))
    again = Mind(*buildings(AT_M))
    assert again.module.restore is not None
    again.module.restore(past)

    stored = stored_in(again.live(3))

    assert {record.map for record in stored.records} == {"remembered:1"}
    assert recollections(again.live(3)) == []


def test_in_lockstep_each_cycle_ends_with_one_offer_once_the_competition_before_has_come() -> None:
    mind = Mind()
    assert of_type(Offer, mind.end(1))
    assert mind.end(2) == []

    assert [offer.cycle for offer in of_type(Offer, mind.compete(1))] == [2]


def test_a_repeated_scan_releases_the_offer_that_waits_for_a_lost_competition() -> None:
    mind = Mind()
    mind.end(1)
    mind.end(2)
    rays = Array.of(np.zeros(1, np.float32))
    scan = RangeScan(stamp_ns=2 * 10**9, frame=2, bearing_rad=rays, range_m=rays)

    assert mind.module.feed(scan) == []
    (offer,) = of_type(Offer, mind.module.feed(scan))

    assert offer.cycle == 2
    assert [again.cycle for again in of_type(Offer, mind.module.feed(scan))] == [2]


def test_in_lockstep_one_that_joins_in_a_cycle_waits_for_no_competition_before_it() -> None:
    mind = Mind()
    mind.commit(5, agent())
    assert mind.module.loaded() == []

    assert [offer.cycle for offer in of_type(Offer, mind.end(5))] == [5]


def test_in_real_time_nothing_is_offered_where_nothing_is_recalled() -> None:
    mind = Mind(run=REAL_TIME)

    assert mind.live(10) == []


def test_of_many_maps_those_are_compared_that_the_objects_around_remind_of() -> None:
    records: list[StoredObjects | StoredTile] = []
    for seed in range(20, 23):
        stranger_m = np.random.default_rng(seed).uniform(-60, 60, (12, 2))
        stored = stored_in(Mind(*buildings(stranger_m)).live(3))
        records += [msgspec.structs.replace(each, map=f"town-{seed}") for each in stored.records]
    config = msgspec.structs.replace(CONFIG, compared_maps=1)
    mind = Mind(*buildings(transform_to(POSE, AT_M)), config=config)
    mind.module.feed(Restored(records=[*records, *_renamed("town-19")]))

    (recalled,) = recollections(mind.end(1) + mind.compete(1))

    assert recalled.map == "town-19"
