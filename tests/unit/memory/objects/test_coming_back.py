"""Workspace and long-term memory together: an object decays, comes back, and may be gone."""

from __future__ import annotations

import math

from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Broadcast, Coalition, Trigger
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.memory import Stored, StoredObjects
from cogmap.schemas.nodes import ROOT_MAP, AnyNode, Object, object_id
from cogmap.services.memory.module import Config, build
from cogmap.testing import of_type, percept
from tests.support.world.scenes import Desk, received

INN = object_id("inn")
TOWN_M = {"inn": (30.0, 6.0), "mill": (32.0, -7.0)}
ROAD = ((2.0, 0.0), (3.0, 0.5))
STEP_S = 0.2
CONSCIOUS_VIEWS = 4


class Life:
    """A workspace whose base levels decay within seconds, and the memory that follows it."""

    def __init__(self) -> None:
        self.desk = Desk("w1", base_level_decay=0.02)
        self.memory = build(Config(store_cycles=1, recall_cycles=1), "memory")
        self.recalled: list[Object] = []
        self.stored: list[str] = []
        self._frame = 0
        self._x_m = 0.0
        self._followed = 0

    def move(self, step_m: float = 0.0, *labels: str) -> None:
        """A cycle: the agent moves east, and sees what has these labels."""
        self._x_m += step_m
        seen = []
        for label in labels:
            x_m, y_m = TOWN_M[label]
            bearing_rad = math.atan2(y_m, x_m - self._x_m)
            seen.append(percept(label, bearing_rad, math.hypot(y_m, x_m - self._x_m)))

        rows = ((step_m / STEP_S, 0.0, STEP_S, 0.0, 0.0),)
        self.desk.see(self._frame, *seen, rows=rows, road_m=ROAD)
        self.desk.work()
        self._frame += 1
        for delta in self.desk.deltas[self._followed :]:
            self._show(delta)
        self._followed = len(self.desk.deltas)

    def tell(self, *nodes: AnyNode, feeling: Feeling = Feeling.NONE) -> None:
        """Something is conscious."""
        coalition = Coalition(
            codelet="test", activation=0.5, nodes=list(nodes), maps=[ROOT_MAP], feeling=feeling
        )
        cycle = self.desk.deltas[-1].cycle
        broadcast = Broadcast(cycle=cycle, trigger=Trigger.AGGREGATE, coalition=coalition)
        self.desk.feed(broadcast)
        self._show(broadcast)

    @property
    def inn(self) -> Object | None:
        """The inn as the workspace has it."""
        return self.desk.graph.get(Object, INN)

    def _show(self, message: Message) -> None:
        for reply in self.memory.feed(received(message)):
            if isinstance(reply, Stored):
                for record in of_type(StoredObjects, reply.records):
                    self.stored = record.labels
            elif isinstance(reply, Offer):
                self.recalled += of_type(Object, reply.operations)
                self.desk.feed(reply)


def learned_and_left() -> Life:
    """An agent that has learned an inn, and has gone far away for so long that it has decayed."""
    life = Life()
    for view in range(12):
        life.move(1.0, *TOWN_M)
        # What is conscious too often is never forgotten.
        if view < CONSCIOUS_VIEWS:
            life.tell(*life.desk.graph.of_kind(Object))

    life.move(-400.0)
    for _ in range(60):
        life.move()
        life.tell()
    return life


def test_an_object_that_has_decayed_is_stored_and_comes_back_when_the_agent_returns() -> None:
    life = learned_and_left()
    assert life.inn is None
    assert "inn" in life.stored
    assert life.recalled == []

    life.move(400.0)
    life.move()
    life.move()

    assert life.inn is not None
    assert sorted(node.label for node in life.recalled) == ["inn", "mill"]
    assert not any(delta.rejected for delta in life.desk.deltas)


def test_an_object_that_comes_back_is_seen_as_itself() -> None:
    life = learned_and_left()
    life.move(400.0)
    life.move()
    for _ in range(3):
        life.move(1.0, *TOWN_M)

    labels = [node.label for node in life.desk.graph.of_kind(Object)]
    assert labels == ["inn", "mill"]
    assert life.inn is not None
    assert life.inn.sightings > life.recalled[0].sightings


def test_an_object_that_comes_back_and_is_missing_is_removed_for_good() -> None:
    life = learned_and_left()
    life.move(400.0)
    life.move()
    assert life.inn is not None

    for _ in range(3):
        gone = Object(id=INN, label="inn", x_m=0.0, y_m=0.0, salience=-1.0)
        life.tell(gone, feeling=Feeling.SURPRISE)
        life.move()
    recalled = [node.label for node in life.recalled].count("inn")
    for _ in range(5):
        life.tell()
        life.move()

    assert life.inn is None
    assert life.stored == ["mill"]
    assert [node.label for node in life.recalled].count("inn") == recalled == 1
