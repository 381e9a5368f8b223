"""Objects that the workspace forgets by time alone stay in long-term memory, and come back."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Broadcast, Coalition, Trigger
from cogmap.schemas.graph import Decay, Delta, DropNode, Operation, Phase
from cogmap.schemas.memory import Stored, StoredObjects
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    Correction,
    CorrectionColumn,
    Map,
    Misfits,
    Object,
    PathColumn,
    PathSegment,
    RecalledColumn,
    Recollection,
    object_id,
    segment_id,
)
from cogmap.services.memory.module import Config, build
from cogmap.testing import agent, of_type

CONFIG = Config(store_cycles=1, recall_cycles=1)
RATES = Decay(activation=0.1, base_level=0.0005, forget_below=0.05, kept_base_level=0.9)
FAR = {"x_m": 500.0}


def building(label: str, x_m: float, base_level: float = 0.5, **facts: Any) -> Object:
    """A building that was seen often, on the x axis, as of the first cycle. All look alike whose
    labels begin alike, up to a hyphen.
    """
    usual = {"sightings": 9, "cycle": 1, "width_m": 8.0, "names": {label.partition("-")[0]: 9.0}}
    return Object(
        id=object_id(label),
        label=label,
        x_m=x_m,
        y_m=0.0,
        base_level=base_level,
        **(usual | facts),
    )


INN = building("inn", 20.0)
MILL = building("mill", 40.0, 1.0)
TOWN = (INN, MILL)


class Mind:
    """Long-term memory in real time, and what the workspace publishes for it."""

    def __init__(self, *objects: Object, settings: Config = CONFIG, **facts: Any) -> None:
        self.graph = Graph()
        self.module = build(settings, "memory")
        self.published: list[Message] = []
        self.cycle = 1
        self.commit(RATES, Map(id=ROOT_MAP, cell_m=1.0), agent(**facts), *objects)

    def commit(self, *operations: Operation, phase: Phase = Phase.OBJECTS) -> None:
        """Commit operations in this cycle."""
        delta = Delta(
            stamp_ns=self.cycle * 10**9,
            version=self.graph.version + 1,
            cycle=self.cycle,
            phase=phase,
            operations=list(operations),
        )
        self.graph.apply(delta)
        self.published += self.module.feed(delta)

    def forget(self, *labels: str) -> None:
        """End a cycle in which objects have decayed."""
        self.live(DropNode(id=object_id(label)) for label in labels)

    def live(self, forgotten: Iterable[DropNode] = (), conscious: Sequence[Object] = ()) -> None:
        """A cycle in which the map is conscious, with some of its objects, and the end of the
        next.
        """
        coalition = Coalition(
            codelet="whereabouts", activation=0.5, nodes=list(conscious), maps=[ROOT_MAP]
        )
        broadcast = Broadcast(cycle=self.cycle, trigger=Trigger.AGGREGATE, coalition=coalition)
        self.published += self.module.feed(broadcast)
        self.cycle += 1
        self.commit(*forgotten, phase=Phase.END)

    def restarted(self) -> Mind:
        """The same with a memory that was restarted."""
        again = Mind()
        again.graph = self.graph
        again.cycle = self.cycle
        again.module = build(CONFIG, "memory")
        assert again.module.restore is not None
        assert again.module.graph is not None
        again.module.restore(of_type(Stored, self.published))
        again.module.graph.load(self.graph.snapshot())
        again.published = again.module.loaded()
        return again

    @property
    def stored(self) -> dict[str, float]:
        """The x of each object in the record that was stored last, by label."""
        records: list[StoredObjects] = []
        for stored in of_type(Stored, self.published):
            records += of_type(StoredObjects, stored.records)

        rows = records[-1].objects.numpy()[:, RecalledColumn.X_M].tolist()
        return dict(zip(records[-1].labels, rows, strict=True))

    @property
    def offered(self) -> list[Object]:
        """The objects that were offered last."""
        offers = of_type(Offer, self.published)
        return of_type(Object, offers[-1].operations) if offers else []


def labels(objects: Iterable[Object]) -> list[str]:
    return [node.label for node in objects]


def test_what_was_forgotten_by_time_alone_stays_stored() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.live()
    mind.forget("inn")
    mind.live()

    assert mind.stored == {"inn": 20.0, "mill": 40.0}


def test_what_was_seen_to_be_missing_is_removed_from_the_store_and_does_not_come_back() -> None:
    mind = Mind(*TOWN)
    mind.live()
    mind.commit(msgspec.structs.replace(INN, base_level=0.1, cycle=2))
    mind.forget("inn")
    mind.live()

    assert mind.stored == {"mill": 40.0}
    assert mind.offered == []


def test_what_was_missing_and_conscious_as_present_later_is_kept() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.commit(msgspec.structs.replace(INN, base_level=0.1, cycle=2))
    mind.commit(msgspec.structs.replace(INN, base_level=0.3, cycle=3))
    mind.forget("inn")
    mind.live()

    assert "inn" in mind.stored


def test_decay_alone_is_not_taken_for_missing() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.commit(msgspec.structs.replace(INN, base_level=0.4, cycle=201))
    mind.forget("inn")
    mind.live()

    assert "inn" in mind.stored


@pytest.mark.parametrize(
    "hardly", [building("inn", 20.0, 0.25), building("inn", 20.0, sightings=2)]
)
def test_what_was_hardly_learned_is_forgotten_for_good(hardly: Object) -> None:
    mind = Mind(hardly, MILL)
    mind.forget("inn")
    mind.live()

    assert mind.stored == {"mill": 40.0}
    assert mind.offered == []


def test_what_a_codelet_drops_is_not_kept() -> None:
    mind = Mind(*TOWN)
    mind.commit(DropNode(id=INN.id))
    mind.live()

    assert mind.stored == {"mill": 40.0}


def test_a_forgotten_object_comes_back_when_the_agent_returns() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.forget("inn")
    assert mind.offered == []

    mind.commit(agent(x_m=0.0))
    mind.live()
    (offered,) = mind.offered
    assert (offered.label, offered.x_m, offered.base_level) == ("inn", 20.0, 0.5)
    assert (offered.cycle, offered.sightings) == (0, 9)


def test_an_agent_that_is_lost_is_reminded_by_what_is_conscious_alone() -> None:
    mind = Mind(*TOWN, misfits=Misfits(is_lost=True))
    mind.forget("inn")
    assert mind.offered == []

    mind.live(conscious=[MILL])
    assert labels(mind.offered) == ["inn"]


def test_what_is_conscious_far_away_reminds_of_nothing() -> None:
    mind = Mind(INN, building("mill", 300.0, 1.0), **FAR)
    mind.forget("inn")
    mind.live(conscious=[building("mill", 300.0)])

    assert mind.offered == []


def test_the_nearest_come_back_first_and_not_all_at_once() -> None:
    inns = [building(f"inn-{number}", 8.0 * number) for number in range(2, 6)]
    mind = Mind(*inns, settings=msgspec.structs.replace(CONFIG, max_returned=2))
    mind.forget(*labels(inns))

    assert labels(mind.offered) == ["inn-2", "inn-3"]


def test_an_object_that_was_learned_anew_does_not_come_back_beside_itself() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.forget("inn")
    mind.commit(building("inn-2", 22.0), agent())
    mind.live()

    assert mind.offered == []
    assert mind.stored == {"inn-2": 22.0, "mill": 40.0}


def test_a_glimpse_of_a_forgotten_object_does_not_take_it_from_memory() -> None:
    mind = Mind(*TOWN)
    mind.forget("inn")
    mind.commit(building("inn", 21.0, 0.15, sightings=1))
    mind.live()
    assert "inn" in mind.stored

    mind.forget("inn")
    assert [(node.label, node.x_m) for node in mind.offered] == [("inn", 20.0)]


def test_an_object_that_has_come_back_and_is_missing_is_gone_for_good() -> None:
    mind = Mind(*TOWN)
    mind.forget("inn")
    mind.commit(msgspec.structs.replace(mind.offered[0], cycle=3))
    mind.commit(msgspec.structs.replace(mind.offered[0], base_level=0.1, cycle=4))
    before = len(mind.published)
    mind.forget("inn")
    mind.live()

    assert mind.stored == {"mill": 40.0}
    assert of_type(Offer, mind.published[before:]) == []


def _rows(new_x_m: float) -> Matrix:
    row = np.zeros((1, len(CorrectionColumn)))
    row[0, CorrectionColumn.NEW_X_M] = new_x_m
    return Matrix.of(row)


def test_a_forgotten_object_moves_as_the_map_is_corrected_and_waits_for_that() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.forget("inn")
    mind.commit(Correction(id=CORRECTION_ID, rows=_rows(5.0)), agent())
    mind.live()
    assert mind.offered == []

    path = PathSegment(id=segment_id(0), number=0, rows=Matrix.of(np.zeros((1, len(PathColumn)))))
    mind.commit(DropNode(id=CORRECTION_ID), path)
    mind.live()
    assert [node.x_m for node in mind.offered] == [25.0]
    assert mind.stored["inn"] == 25.0


def test_a_forgotten_object_moves_into_the_frame_of_a_map_that_is_joined() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.forget("inn")
    recalled = Recollection(
        id=RECOLLECTION_ID,
        map="remembered:7",
        x_m=0.0,
        y_m=10.0,
        heading_rad=math.pi / 2,
        labels=["12a"],
        names=["mill"],
        given_names=[""],
        functions=[""],
        matched=["mill"],
        objects=Matrix.of(np.zeros((1, len(RecalledColumn)))),
        tiles=[],
        columns={},
    )
    mind.commit(recalled)
    joined = Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:7")
    mind.commit(DropNode(id=RECOLLECTION_ID), joined, agent())
    mind.live()

    ((x_m, y_m),) = [(node.x_m, node.y_m) for node in mind.offered]
    assert (x_m, y_m) == pytest.approx((0.0, 30.0))


def test_a_memory_that_was_restarted_still_has_what_was_forgotten() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.live()
    mind.forget("inn")
    again = mind.restarted()
    again.commit(agent())
    again.live()

    assert [(node.label, node.x_m) for node in again.offered] == [("inn", 20.0)]
    assert again.stored == {"inn": 20.0, "mill": 40.0}


def test_a_journal_that_is_shortened_right_after_a_restart_keeps_what_was_forgotten() -> None:
    mind = Mind(*TOWN, **FAR)
    mind.forget("inn")
    mind.live()
    again = mind.restarted()
    assert again.module.compact is not None
    again.published = [again.module.compact()]

    assert again.stored == {"inn": 20.0, "mill": 40.0}


def test_a_memory_that_was_restarted_has_nothing_of_what_was_missing() -> None:
    mind = Mind(*TOWN)
    mind.live()
    mind.commit(msgspec.structs.replace(INN, base_level=0.1, cycle=2))
    mind.forget("inn")
    mind.live()
    again = mind.restarted()
    again.live()

    assert again.offered == []


def test_what_was_forgotten_while_deltas_were_lost_is_kept() -> None:
    mind = Mind(*TOWN)
    assert mind.module.graph is not None
    mind.graph.change([DropNode(id=INN.id)])
    mind.module.graph.load(mind.graph.snapshot())
    mind.module.loaded()
    mind.live()

    assert labels(mind.offered) == ["inn"]
