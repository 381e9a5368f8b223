"""One voice a source, over either bus: which incarnation of a source is received."""

from __future__ import annotations

import pytest

from cogmap.bus.codec import encode
from cogmap.bus.interface import Arrival, Bus, Incarnation, Member
from cogmap.errors import UsageError
from cogmap.runtime.delivery.numbers import MAX_JUMP
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.succession import Place, take_place
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import Odometry
from cogmap.testing import odometry
from tests.support.system.networks import (
    Network,
    Peer,
    await_members,
    envelope_of,
    meet,
    publish,
    spin_until,
)
from tests.support.system.processes import wait_until

FIRST, SECOND, LIAR = 1, 2, 2**61
WHEELS = topics.ODOMETRY


def lie(network: Network, *messages: Message, incarnation: int = LIAR) -> None:
    """Put messages past every check, under the name of their source."""
    for message in messages:
        envelope = encode(envelope_of(message, incarnation))
        network.put(topics.of(message), encode(message), envelope)


def taken(peer: Peer) -> Arrival:
    (arrival,) = peer.take(1)
    return arrival


class Wheels:
    """A publisher of odometry, and somebody who receives it."""

    def __init__(self, network: Network, topic: topics.Topic = WHEELS) -> None:
        self.bus = network.join()
        self.bus.declare(topic)
        self.peer = Peer(network.join(), topic)
        meet(self.bus, self.peer.bus)

    def take_number(self) -> int:
        """The number of the next message that counts."""
        arrival = taken(self.peer)
        assert arrival.refused == ""
        assert arrival.envelope is not None
        return arrival.envelope.seq


@pytest.fixture
def wheels(network: Network) -> Wheels:
    return Wheels(network)


def test_a_message_that_claims_a_newer_incarnation_is_refused_and_named(
    network: Network, wheels: Wheels
) -> None:
    publish(wheels.bus, odometry(0), incarnation=FIRST)
    assert wheels.take_number() == 0

    lie(network, odometry(1))
    arrival = taken(wheels.peer)

    assert arrival.refused.startswith("it says it is of 'sim', started at 2043-")
    assert arrival.refused.endswith("which is not on the bus")


def test_a_source_is_received_while_another_speaks_in_its_name(
    network: Network, wheels: Wheels
) -> None:
    for number in range(20):
        lie(network, odometry(number))
        publish(wheels.bus, odometry(number), incarnation=FIRST)

    heard = []
    while len(heard) < 20:
        arrival = taken(wheels.peer)
        assert arrival.envelope is not None
        if not arrival.refused:
            heard.append((arrival.envelope.incarnation, arrival.envelope.seq))
    assert heard == [(FIRST, number) for number in range(20)]


def test_a_clock_in_anothers_name_does_not_take_the_place_of_its_own(network: Network) -> None:
    clocks = Wheels(network, topics.CLOCK)
    real = Clock(seq=1, source="sim", stamp_ns=1)
    publish(clocks.bus, real, incarnation=FIRST)
    clocks.peer.wait_for(1)

    lie(network, Clock(seq=2, source="sim", stamp_ns=2**60))
    clocks.peer.wait_for(2)

    first, second = clocks.peer.take(2)
    assert (first.payload, first.refused) == (encode(real), "")
    assert second.refused


def test_what_comes_before_its_token_is_received_in_order(network: Network, wheels: Wheels) -> None:
    early = [odometry(number, source="late") for number in range(5)]
    lie(network, *early, incarnation=SECOND)

    wheels.bus.claim(Incarnation("sim", "late", SECOND))

    assert [wheels.take_number() for _ in range(5)] == [0, 1, 2, 3, 4]


def test_a_source_that_left_and_came_again_is_its_own_successor(network: Network) -> None:
    first = network.join()
    second = network.join()
    peer = Peer(network.join(), WHEELS)
    for bus, incarnation in ((first, SECOND), (second, FIRST)):
        bus.declare(WHEELS)
        meet(bus, peer.bus)
        publish(bus, odometry(0), incarnation=incarnation)
        arrival = taken(peer)
        assert arrival.refused == ""
        bus.close()


def test_of_two_at_once_the_second_is_refused_and_said(network: Network, wheels: Wheels) -> None:
    publish(wheels.bus, odometry(0), incarnation=FIRST)
    assert wheels.take_number() == 0
    second = network.join()
    second.declare(WHEELS)
    meet(second, wheels.peer.bus)

    publish(second, odometry(0), incarnation=SECOND)
    arrival = taken(wheels.peer)
    publish(wheels.bus, odometry(1), incarnation=FIRST)

    assert "while the one started at" in arrival.refused
    assert wheels.take_number() == 1
    (conflict,) = wheels.peer.bus.conflicts()
    assert conflict.startswith("2 processes publish as sim: the one started at 1970-01-01")

    second.close()
    wait_until(lambda: wheels.peer.bus.conflicts() == [], "the second is gone")


def test_whoever_publishes_is_on_the_bus_with_its_incarnation(
    network: Network, wheels: Wheels
) -> None:
    wheels.bus.announce(Member("sim", "sim"))
    publish(wheels.bus, odometry(0), incarnation=FIRST)
    assert wheels.take_number() == 0

    here = wheels.peer.bus
    wait_until(lambda: len(here.incarnations()) == 1, "it is listed")
    # Zenoh's own query misses now and then a token that the session watches.
    listed = [here.incarnations() for _ in range(40)]
    (incarnation,) = listed[0]
    assert (incarnation.source, incarnation.number) == ("sim", FIRST)
    assert listed == 40 * [[incarnation]]
    assert Member("sim", "sim") in here.members()


def test_a_new_round_of_a_player_follows_the_one_before(wheels: Wheels) -> None:
    for incarnation in (FIRST, SECOND):
        publish(wheels.bus, *(odometry(number) for number in range(100)), incarnation=incarnation)

    assert [wheels.take_number() for _ in range(200)] == 2 * list(range(100))


class Listener:
    """A module in a shell that keeps the numbers of the odometry that it receives."""

    def __init__(self, network: Network) -> None:
        self.seqs: list[int] = []
        module = Module("listener").on(WHEELS, self._on_odometry)
        self.shell = Shell(module, network.join(), health=False)
        self.shell.open()
        self.sim = network.join()
        self.sim.declare(WHEELS)
        meet(self.sim, self.shell.bus)

    def _on_odometry(self, message: Odometry) -> None:
        self.seqs.append(message.seq)

    def hear(self, *numbers: int) -> None:
        publish(self.sim, *map(odometry, numbers), incarnation=FIRST)

    def await_seqs(self, *numbers: int) -> None:
        spin_until(lambda: self.seqs == list(numbers), self.shell)


@pytest.fixture
def listener(network: Network) -> Listener:
    return Listener(network)


def test_a_number_far_ahead_is_refused_and_the_source_continues(
    network: Network, listener: Listener
) -> None:
    listener.hear(0)
    lie(network, odometry(2**61), incarnation=FIRST)
    listener.hear(1, 2)
    listener.await_seqs(0, 1, 2)

    spin_until(lambda: listener.shell.intake.rejected[WHEELS.name] == 1, listener.shell)
    assert not listener.shell.intake.gaps


def test_a_plausible_lie_hides_none_of_the_sources_own_messages(
    network: Network, listener: Listener
) -> None:
    listener.hear(0)
    listener.await_seqs(0)
    lie(network, odometry(5), incarnation=FIRST)
    listener.await_seqs(0, 5)
    assert listener.shell.intake.gaps == {WHEELS.name: 4}

    listener.hear(1, 2, 3, 4)
    listener.await_seqs(0, 5, 1, 2, 3, 4)

    assert not listener.shell.intake.gaps


def test_a_source_that_continues_after_a_long_gap_is_received_and_the_gap_counted(
    listener: Listener,
) -> None:
    after = 3 * MAX_JUMP
    listener.hear(0, after, after + 1, after + 2, after + 3)
    listener.await_seqs(0, after + 2, after + 3)

    assert listener.shell.intake.gaps == {WHEELS.name: after + 1}


def motor(instance: str) -> Module:
    return Module("motor", instance, emits={topics.MOTOR_COMMAND})


def take(bus: Bus, module: Module, number: int, is_single: bool = True) -> None:
    """Take a place that somebody has, if he does not leave at once."""
    take_place(bus, Place(module, number, is_single), timeout_s=0.0)


@pytest.mark.parametrize("instance", ["motor", "motor-2"])
def test_a_second_of_a_single_module_is_refused_by_a_sentence(
    network: Network, instance: str
) -> None:
    first = network.join()
    second = network.join()
    take(first, motor("motor"), FIRST)
    first.announce(Member("motor", "motor"))
    await_members(second, Member("motor", "motor"))

    with pytest.raises(UsageError, match=r"^motor, started at 1970.* a second motor .*--agent$"):
        take(second, motor(instance), SECOND)


def test_one_that_states_no_incarnation_is_in_its_place_too(network: Network) -> None:
    foreign = network.join()
    second = network.join()
    wanderer = Member("motor", "wanderer")
    foreign.announce(wanderer)
    wait_until(lambda: second.members() == [wanderer], "it is listed")

    with pytest.raises(UsageError, match=r"^wanderer is on the bus already"):
        take(second, motor("motor"), SECOND)


def test_workers_of_one_module_are_beside_each_other_but_not_under_one_name(
    network: Network,
) -> None:
    first = network.join()
    second = network.join()
    take(first, Module("codelets", "codelets-1"), FIRST, is_single=False)
    first.announce(Member("codelets", "codelets-1"))
    await_members(second, Member("codelets", "codelets-1"))

    take(second, Module("codelets", "codelets-2"), SECOND, is_single=False)
    with pytest.raises(UsageError, match=r"codelets-1, started at .*--instance$"):
        take(network.join(), Module("codelets", "codelets-1"), SECOND, is_single=False)


def test_a_place_is_free_once_its_process_has_left(network: Network) -> None:
    first = network.join()
    second = network.join()
    take(first, motor("motor"), SECOND)
    first.announce(Member("motor", "motor"))
    await_members(second, Member("motor", "motor"))

    first.close()
    take_place(second, Place(motor("motor"), FIRST, is_single=True))

    assert second.incarnations() == [Incarnation("motor", "motor", FIRST)]


def test_of_two_that_start_at_once_the_earlier_does_not_wait(network: Network) -> None:
    later = network.join()
    later.claim(Incarnation("motor", "motor-2", SECOND))
    earlier = network.join()

    take(earlier, motor("motor"), FIRST)

    with pytest.raises(UsageError, match=r"^motor, started at"):
        take(later, motor("motor-2"), SECOND)


def test_a_process_that_waits_for_its_place_may_be_asked_to_end(network: Network) -> None:
    first = network.join()
    take(first, motor("motor"), FIRST)

    with pytest.raises(KeyboardInterrupt):
        take_place(network.join(), Place(motor("motor"), SECOND, is_single=True), lambda: True)
