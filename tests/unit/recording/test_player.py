"""Playing a log back onto the in-memory bus."""

from __future__ import annotations

import time
from pathlib import Path

import msgspec
import pytest

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.errors import UsageError
from cogmap.recording.replaying.player import Choices, Played, Player
from cogmap.recording.storage.format import topics_to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.writer import LogWriter
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Presence
from cogmap.testing import odometry, percepts
from tests.support.logs import SECOND_NS, write_log

MILLISECOND_NS = 10**6
COUNT = 10
FAST = 1e6
AGE_NS = 5 * MILLISECOND_NS


class Script:
    """Never waits; ends after so many calls, pauses or continues at those in `pauses`, and wishes
    so many steps.
    """

    def __init__(
        self, end_after: int | None = None, pauses: tuple[int, ...] = (), steps: int = 0
    ) -> None:
        self.calls = 0
        self._steps = steps
        self.paused = False
        self._end_after = end_after
        self._pauses = pauses

    @property
    def asked(self) -> bool:
        return self._end_after is not None and self.calls >= self._end_after

    def take_step(self) -> bool:
        self._steps -= 1
        return self._steps >= 0

    def wait(self, timeout_s: float) -> bool:
        self.calls += 1
        if self.calls in self._pauses:
            self.paused = not self.paused
        return self.asked


def spoken(seq: int) -> list[Message]:
    """What the simulator and the workspace publish at one time."""
    presence = Presence(
        seq=seq, source="workspace", module="m", instance="m", alive=True, observer="workspace"
    )
    clock = Clock(seq=seq, stamp_ns=seq, source="sim")
    return [odometry(seq, stamp_ns=seq), clock, presence]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Messages every 10 ms, each 5 ms old when it was sent."""
    path = tmp_path / "log.mcap"
    writer = LogWriter(path, topics_to_record(), {})
    for seq in range(COUNT):
        at_ns = SECOND_NS + 10 * seq * MILLISECOND_NS
        for message in spoken(seq):
            envelope = Envelope(message.source, seq, 7, at_ns, at_ns - AGE_NS, [("sim", 1, 2)])
            writer.write(topics.of(message), encode(message), envelope, at_ns)

    writer.close()
    return path


class Listener:
    """Everything that arrives, checked as a module checks it."""

    def __init__(self, network: MemoryNetwork) -> None:
        self.intake = Intake()
        self.arrivals: list[Arrival] = []
        bus = MemoryBus(network)
        for topic in topics_to_record():
            bus.subscribe(topic, self.arrivals.append, self.intake.count_lost)

    def of(self, topic: topics.Topic) -> list[Message]:
        """The messages of a topic that were accepted."""
        arrivals = [arrival for arrival in self.arrivals if arrival.topic is topic]
        accepted = [self.intake.accept(arrival) for arrival in arrivals]
        assert not self.intake.rejected
        return [message for message in accepted if message is not None]

    def numbers(self, topic: topics.Topic) -> list[int]:
        """Their numbers."""
        return [message.seq for message in self.of(topic)]


def play(path: Path, choices: Choices, script: Script | None = None) -> tuple[Listener, Played]:
    network = MemoryNetwork()
    listener = Listener(network)
    player = Player(LogReader(path), MemoryBus(network), choices, script or Script())
    return listener, player.play()


def test_the_model_is_played_in_order_with_its_own_numbers_and_age(path: Path) -> None:
    listener, played = play(path, Choices(rate=FAST))
    assert listener.numbers(topics.ODOMETRY) == list(range(COUNT))
    assert played.messages == {"odometry": COUNT, "clock": COUNT}

    envelope = listener.arrivals[0].envelope
    assert envelope is not None
    assert envelope.source == "sim"
    assert envelope.stages == [("sim", 1, 2)]
    assert envelope.sent_ns - envelope.born_ns == AGE_NS
    assert abs(time.time_ns() - envelope.sent_ns) < 60 * SECOND_NS


def test_only_the_chosen_topics_are_played_even_those_about_processes(path: Path) -> None:
    choices = Choices(rate=FAST, topics=[topics.PRESENCE])
    _, played = play(path, choices)

    assert played.messages == {"presence": COUNT}


def test_a_start_offset_leaves_out_what_was_before_it(path: Path) -> None:
    choices = Choices(rate=FAST, start_offset_s=0.045)
    listener, _ = play(path, choices)

    assert listener.numbers(topics.ODOMETRY) == list(range(5, COUNT))


def test_what_comes_later_than_the_end_that_is_chosen_is_left_out(path: Path) -> None:
    choices = Choices(rate=FAST, start_offset_s=0.015, end_s=0.045)
    listener, _ = play(path, choices)

    assert listener.numbers(topics.ODOMETRY) == [2, 3, 4]


def test_each_round_of_a_loop_is_accepted_with_numbers_from_0(path: Path) -> None:
    network = MemoryNetwork()
    listener = Listener(network)

    class Rounds(Script):
        @property
        def asked(self) -> bool:
            return len(listener.arrivals) >= 6 * COUNT

    choices = Choices(rate=FAST, loop=True)
    player = Player(LogReader(path), MemoryBus(network), choices, Rounds())
    played = player.play()

    assert played.rounds >= 3
    assert listener.numbers(topics.ODOMETRY) == 3 * list(range(COUNT))


@pytest.mark.parametrize("rate", [1.0, 3.0])
def test_the_rate_sets_the_pace(path: Path, rate: float) -> None:
    _, played = play(path, Choices(rate=rate))

    assert played.wall_s >= 0.090 / rate


def test_a_pause_stops_time_and_nothing_is_skipped(path: Path) -> None:
    script = Script(pauses=(3, 2000))
    listener, _ = play(path, Choices(rate=1.0), script)

    assert script.calls >= 2000
    assert len(listener.of(topics.ODOMETRY)) == COUNT


def test_it_ends_when_asked(path: Path) -> None:
    script = Script(end_after=50)
    listener, played = play(path, Choices(rate=1e-3), script)

    assert len(listener.of(topics.ODOMETRY)) == 1
    assert played.rounds == 1


def test_the_clock_has_the_newest_stamp_in_place_of_the_recorded_clock(path: Path) -> None:
    choices = Choices(rate=1.0, clock_hz=500.0)
    listener, _ = play(path, choices)
    clocks = listener.of(topics.CLOCK)
    stamps = [clock.stamp_ns for clock in clocks]
    numbers = [clock.seq for clock in clocks]

    assert {clock.source for clock in clocks} == {"replay"}
    assert stamps == sorted(stamps)
    assert stamps[-1] == COUNT - 1
    assert numbers == list(range(len(clocks)))


def test_others_see_that_a_replay_is_there(path: Path) -> None:
    network = MemoryNetwork()
    player = Player(LogReader(path), MemoryBus(network), Choices(rate=FAST), Script())
    player.play()

    assert Member("replay", "replay") in network.members


def test_a_rate_that_stands_still_is_refused(path: Path) -> None:
    standing = Choices(rate=0.0)

    with pytest.raises(UsageError, match="rate 0"):
        Player(LogReader(path), MemoryBus(MemoryNetwork()), standing, Script())


def test_the_share_that_is_played_rises_to_the_whole_of_each_round(path: Path) -> None:
    shares: list[float] = []
    network = MemoryNetwork()
    choices = Choices(rate=FAST, topics=[topics.ODOMETRY])

    Player(LogReader(path), MemoryBus(network), choices, Script()).play(shares.append)

    assert shares == sorted(shares)
    assert len(shares) == COUNT
    assert 0.0 <= shares[0] < shares[-1] <= 1.0


def test_a_step_of_a_paused_replay_ends_with_a_view(tmp_path: Path) -> None:
    rows = [odometry(0), percepts(1), odometry(1), odometry(2), percepts(2), odometry(3)]
    numbered = [msgspec.structs.replace(row, seq=seq) for seq, row in enumerate(rows)]
    path = write_log(tmp_path / "log.mcap", enumerate(numbered, SECOND_NS))
    script = Script(end_after=1, steps=2)
    script.paused = True

    _, played = play(path, Choices(rate=FAST), script)

    assert played.messages == {"odometry": 3, "epam/percepts": 2}


def test_without_views_a_step_is_a_message(path: Path) -> None:
    script = Script(end_after=1, steps=3)
    script.paused = True

    _, played = play(path, Choices(rate=FAST, topics=[topics.ODOMETRY]), script)

    assert played.messages == {"odometry": 3}
