"""The table of who may do what is what each module declares, and what each command needs."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cogmap.bus.access.subjects import OBSERVER, OPERATOR, SUBJECTS, Subject
from cogmap.cli.dashboard import live
from cogmap.cli.dashboard.scene import FOLLOWED as SHOWN
from cogmap.cli.goal import Person
from cogmap.cli.launch import tally, watch
from cogmap.cli.name import Namer
from cogmap.cli.teleop import Steering
from cogmap.errors import AccessError
from cogmap.ros2 import bridge
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic
from cogmap.services import registry

RUNS: tuple[Sections, ...] = (
    {"run": {"lockstep": True, "energy": True}, "sim": {"egl": False}},
    {"run": {"lockstep": False, "energy": False}, "sim": {"egl": False}},
    {"run": {"lockstep": True}, "sim": {"sensing": "percepts"}},
    {"run": {"lockstep": True, "participants": {"player": 1}}},
)
"""Configurations between which each module declares all that it ever does."""


def built(name: str) -> Iterator[Module]:
    for sections in RUNS:
        is_recorded = "player" in sections["run"].get("participants", {})
        if name != "player" or not is_recorded:
            yield registry.build(name, sections)


def declared(modules: Iterator[Module]) -> Subject:
    """Collect what modules of one name declare, and what their shells do for them."""
    publishes: set[Topic] = {topics.HEALTH}
    subscribes: set[Topic] = set()
    answers: set[Topic] = {topics.SETTINGS_REQUEST}
    asks: set[Topic] = set()
    name = ""
    for module in modules:
        name = module.name
        publishes |= module.emits
        subscribes |= module.handlers.keys() - {topics.PRESENCE}
        answers |= module.served.keys()
        if module.heartbeats:
            subscribes.add(topics.HEALTH)
        if module.graph is not None:
            asks.add(topics.SNAPSHOT_REQUEST)
        if module.remembers:
            publishes.add(topics.RESTORED)
    return Subject(
        name,
        publishes=frozenset(publishes),
        subscribes=frozenset(subscribes),
        answers=frozenset(answers),
        asks=frozenset(asks),
        members=(name,),
    )


@pytest.mark.parametrize("name", registry.MODULES)
def test_a_module_may_do_exactly_what_it_declares(name: str) -> None:
    assert SUBJECTS[name] == declared(built(name))


def test_each_topic_of_the_model_has_a_module_that_may_publish_it() -> None:
    modules = [SUBJECTS[name] for name in registry.MODULES]
    by_modules = frozenset[Topic]().union(*(each.publishes | each.answers for each in modules))
    by_people = {topics.STREET_CLOSURE, topics.RESET, topics.PAUSE}
    answers = {topics.SNAPSHOT, topics.SETTINGS}

    assert set(topics.ALL) - by_modules == by_people | answers


def test_an_operator_may_do_what_a_persons_commands_do() -> None:
    operator = SUBJECTS[OPERATOR]
    for module in (Person([], False).module, Namer().module, Steering().module()):
        assert module.emits | {topics.HEALTH} <= operator.publishes
        assert module.handlers.keys() <= operator.subscribes
        operator.check_is(module.name, module.instance)

    assert set(live.PUBLISHED) <= operator.publishes
    assert set(SHOWN) <= operator.subscribes


def test_an_observer_reads_all_and_publishes_nothing() -> None:
    observer = SUBJECTS[OBSERVER]

    assert observer.subscribes == frozenset(topics.ALL)
    assert not observer.publishes
    assert not observer.answers


def test_a_drive_may_do_what_its_observer_does() -> None:
    drive = SUBJECTS["drive"]

    assert drive.publishes == frozenset(watch.PUBLISHED)
    assert set(tally.FOLLOWED) <= drive.subscribes
    drive.check_is("observer", "observer")


def test_a_robot_may_do_what_its_bridge_declares() -> None:
    robot = SUBJECTS["ros2"]

    assert set(bridge._EMITS) | {topics.HEALTH} == robot.publishes
    robot.check_is(bridge.NAME, bridge.INSTANCE)


def test_nobody_reads_the_truth_but_who_observes() -> None:
    truth = {topics.TRUE_POSE, topics.TRUE_TOWN, topics.PLAYBACK}
    readers = {name for name, each in SUBJECTS.items() if truth & each.subscribes}

    assert readers.isdisjoint(registry.MODULES)


def test_a_refusal_names_whose_keys_would_do() -> None:
    with pytest.raises(AccessError, match=r"observer may not publish workspace/offer: .*operator"):
        SUBJECTS[OBSERVER].check_publishes(topics.OFFER)


def test_a_module_may_not_say_that_it_is_another() -> None:
    with pytest.raises(AccessError, match=r"epam may not be motor of motor: use those of motor"):
        SUBJECTS["epam"].check_is("motor", "motor")
    with pytest.raises(AccessError):
        SUBJECTS[OPERATOR].check_is("motor", "motor")
