"""What a user publishes beside the processes of a running system."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.bus.codec import decode
from cogmap.bus.discovery import Role, System, identity_key, read, use_key
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.topic.publishing import Publisher, Stamps, check_unpublished
from cogmap.errors import UsageError
from cogmap.schemas import topics
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand
from cogmap.schemas.topics import Topic
from cogmap.services import registry
from tests.support.logs import SECOND_NS
from tests.support.system.networks import publish

AGENT = "agent"
COMMAND = MotorCommand(left_wheel_rad_s=1.0, right_wheel_rad_s=2.0)


def publishing(topic: Topic, *members: Member) -> System:
    """A system in which these members publish `topic`."""
    sessions = {f"zid{number}": member for number, member in enumerate(members)}
    return read(
        AGENT,
        named=[identity_key(AGENT, zid, member) for zid, member in sessions.items()],
        used=[use_key(AGENT, zid, Role.PUBLISHES.value, topic.name) for zid in sessions],
    )


def test_a_topic_that_a_module_publishes_is_refused_with_the_remedy() -> None:
    system = publishing(topics.MOTOR_COMMAND, Member("motor", "motor"))

    with pytest.raises(UsageError, match=r"^motor publishes motor/command already.*--as motor"):
        check_unpublished(system, topics.MOTOR_COMMAND)


def test_another_publisher_of_the_topic_is_to_be_ended() -> None:
    system = publishing(topics.MOTOR_COMMAND, Member("wanderer", "wanderer"))

    with pytest.raises(UsageError, match=r"wanderer publishes .*: end it first"):
        check_unpublished(system, topics.MOTOR_COMMAND)


def test_a_topic_that_nobody_publishes_is_free() -> None:
    check_unpublished(publishing(topics.ODOMETRY, Member("sim", "sim")), topics.MOTOR_COMMAND)


def test_an_offer_is_free_to_all() -> None:
    system = publishing(topics.OFFER, Member("memory", "memory"), Member("motor", "motor"))

    check_unpublished(system, topics.OFFER)


def test_of_a_topic_that_is_not_shared_a_simulated_run_has_one_publisher() -> None:
    settings = {"sim": {"egl": False}}
    modules = [registry.build(name, settings) for name in registry.taking_part()]
    published = [topic for module in modules for topic in module.emits]

    twice = {topic.name for topic in published if published.count(topic) > 1}

    assert twice <= {topic.name for topic in topics.ALL if topic.shared}


def test_a_message_without_a_stamp_gets_the_time_of_the_clock() -> None:
    network = MemoryNetwork()
    system = publishing(topics.CLOCK, Member("sim", "sim"))
    stamps = Stamps(MemoryBus(network), system)
    sim = MemoryBus(network)
    for number, stamp_ns in enumerate((SECOND_NS, 2 * SECOND_NS)):
        publish(sim, Clock(stamp_ns=stamp_ns, seq=number, source="sim"))

    assert stamps.stamped(COMMAND).stamp_ns == 2 * SECOND_NS
    assert stamps.stamped(msgspec.structs.replace(COMMAND, stamp_ns=7)).stamp_ns == 7


def test_without_a_clock_a_message_has_no_stamp() -> None:
    stamps = Stamps(MemoryBus(MemoryNetwork()), read(AGENT))

    assert stamps.stamped(COMMAND).stamp_ns == 0


def test_published_messages_are_numbered() -> None:
    network = MemoryNetwork()
    arrived: list[Arrival] = []
    MemoryBus(network).subscribe(topics.MOTOR_COMMAND, arrived.append, lambda name, number: None)
    publisher = Publisher(MemoryBus(network), topics.MOTOR_COMMAND)

    publisher.publish(COMMAND)
    publisher.publish(COMMAND)

    received = [decode(topics.MOTOR_COMMAND, each.payload) for each in arrived]
    assert [message.seq for message in received] == [0, 1]
