"""Statistics of several topics at once."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from cogmap.bus.codec import encode
from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.topic.listing import find
from cogmap.cli.topic.observing import Reception, Receptions
from cogmap.cli.topic.rates import Watched, chosen, counting, report
from cogmap.cli.topic.statistics import Rate
from cogmap.errors import UsageError
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Delivery, Topic
from cogmap.testing import odometry
from tests.support.logs import SECOND_NS
from tests.support.system.networks import envelope_of, publish


def watched(topic: Topic, *at_s: int) -> Watched:
    """A topic on which messages arrived at these times."""
    found = Watched(topic, Rate(10))
    for each in at_s:
        found.add(Reception(Arrival(topic, b"", None, each * SECOND_NS)))
    return found


def arrival(message: Message) -> Arrival:
    return Arrival(topics.of(message), encode(message), envelope_of(message), 0)


def test_the_statistics_of_several_topics_have_their_names() -> None:
    shown = report([watched(topics.ODOMETRY, 0, 2), watched(topics.SCAN)], final=False)

    first, second, *_ = shown.splitlines()
    assert (first, second) == ("odometry", "  average rate: 0.500")
    assert "sensory/scan" not in shown


def test_what_is_not_new_is_not_shown_again_until_the_end() -> None:
    one = watched(topics.ODOMETRY, 0, 2)
    assert "average rate" in report([one], final=False)

    assert report([one], final=False) == "no new messages of odometry"
    assert "average rate" in report([one], final=True)


def test_programs_read_the_topic_with_its_statistics() -> None:
    facts = json.loads(watched(topics.ODOMETRY, 0, 2).json())

    assert (facts["topic"], facts["messages"], facts["rate_hz"]) == ("odometry", 2, 0.5)


def test_every_topic_that_is_published_can_be_watched() -> None:
    found = chosen([], everything=True)

    assert topics.ODOMETRY in found
    assert Delivery.ON_REQUEST not in {topic.delivery for topic in found}


def test_topics_are_watched_once_each() -> None:
    assert chosen(["odometry", "sensory/scan", "odometry"], everything=False) == [
        topics.ODOMETRY,
        topics.SCAN,
    ]


@pytest.mark.parametrize("names", [(), ("odometry",)])
def test_topics_or_all_are_to_be_given(names: tuple[str, ...]) -> None:
    with pytest.raises(UsageError, match="--all"):
        chosen(names, everything=bool(names))


def test_arrivals_on_several_topics_are_taken_in_order() -> None:
    network = MemoryNetwork()
    receptions = Receptions(MemoryBus(network), [topics.ODOMETRY, topics.SELF_MOTION])
    publish(MemoryBus(network), odometry(0))

    received = receptions.take(1.0)

    assert received is not None
    assert received.topic is topics.ODOMETRY


def test_only_messages_that_are_meant_count() -> None:
    slow, fast = odometry(0, speed_m_s=1.0), odometry(1, speed_m_s=2.0)
    counts = counting("speed_m_s > 1.5", [topics.ODOMETRY])

    assert not counts(arrival(slow))
    assert counts(arrival(fast))


def test_a_condition_is_for_one_topic() -> None:
    with pytest.raises(UsageError, match="--filter is for the messages of one topic"):
        counting("speed_m_s > 1.5", [topics.ODOMETRY, topics.SCAN])


def test_topics_of_a_type_are_counted() -> None:
    assert CliRunner().invoke(find, ["-c", "Odometry"]).output == "1\n"
    assert CliRunner().invoke(find, ["-c", "Nothing"]).output == "0\n"
