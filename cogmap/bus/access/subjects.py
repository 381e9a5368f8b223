"""The one table of who may do what on the bus. Tests compare it with what each module declares."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from cogmap.errors import AccessError
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic

OPERATOR = "operator"
OBSERVER = "observer"
RECORDER = "recorder"
DRIVE = "drive"
REPLAY = "replay"
ROS2 = "ros2"
ROUTER = "router"

ACTS = (OPERATOR,)
"""Whose keys a command uses that changes something."""
READS = (OBSERVER, OPERATOR)
"""Whose keys a command uses that only reads: those of the first that is in the folder."""
ACTS_OR_READS = (OPERATOR, OBSERVER)
"""Whose keys the dashboard uses: without those of the operator it only shows."""


@dataclass(frozen=True)
class Subject:
    """Whoever holds a certificate of that name.

    It `answers` and `asks` requests. It may say that it is each of `members`: a module, or one
    instance of it as MODULE/INSTANCE. One that `discovers` may see who does what on the bus, as
    everybody may see who is ready.
    """

    name: str
    publishes: frozenset[Topic] = frozenset()
    subscribes: frozenset[Topic] = frozenset()
    answers: frozenset[Topic] = frozenset()
    asks: frozenset[Topic] = frozenset()
    members: tuple[str, ...] = ()
    discovers: bool = False

    def check_publishes(self, topic: Topic) -> None:
        """Raise AccessError if it may not publish `topic`."""
        if topic not in self.publishes:
            raise self._refusal(f"publish {topic.name}", lambda other: topic in other.publishes)

    def check_subscribes(self, topic: Topic) -> None:
        """Raise AccessError if it may not subscribe to `topic`."""
        if topic not in self.subscribes:
            raise self._refusal(
                f"subscribe to {topic.name}", lambda other: topic in other.subscribes
            )

    def check_answers(self, request: Topic) -> None:
        """Raise AccessError if it may not answer `request`."""
        if request not in self.answers:
            raise self._refusal(f"answer {request.name}", lambda other: request in other.answers)

    def check_asks(self, request: Topic) -> None:
        """Raise AccessError if it may not ask `request`."""
        if request not in self.asks:
            raise self._refusal(f"ask {request.name}", lambda other: request in other.asks)

    def check_is(self, module: str, instance: str) -> None:
        """Raise AccessError if it may not say that it is that instance of `module`."""
        if not self.may_be(module, instance):
            raise self._refusal(
                f"be {instance} of {module}", lambda other: other.may_be(module, instance)
            )

    def may_be(self, module: str, instance: str) -> bool:
        """Return whether it may say that it is that instance of `module`."""
        return module in self.members or f"{module}/{instance}" in self.members

    def _refusal(self, deed: str, may: Callable[[Subject], bool]) -> AccessError:
        allowed = [other.name for other in SUBJECTS.values() if may(other)]
        remedy = f"use those of {' or '.join(allowed)}" if allowed else "nobody's may"
        return AccessError(f"the keys of {self.name} may not {deed}: {remedy}")


_ALL = frozenset(topics.ALL)
_REQUESTS = frozenset({topics.SNAPSHOT_REQUEST, topics.SETTINGS_REQUEST})
_STREAMED = frozenset(topic for topic in topics.ALL if topic.delivery is not Delivery.ON_REQUEST)
_CLI = ("cli",)


def module_row(
    name: str,
    publishes: Iterable[Topic],
    subscribes: Iterable[Topic],
    answers: Iterable[Topic] = (),
    remembers: bool = False,
) -> Subject:
    """Return the row of a module. Each publishes its health and answers for its settings; one that
    follows the graph asks for a snapshot, and one that `remembers` publishes what it restores.
    """
    heard = frozenset(subscribes)
    restored = [topics.RESTORED] if remembers else []
    return Subject(
        name,
        publishes=frozenset([*publishes, *restored, topics.HEALTH]),
        subscribes=heard,
        answers=frozenset([*answers, topics.SETTINGS_REQUEST]),
        asks=frozenset([topics.SNAPSHOT_REQUEST] if topics.DELTA in heard else []),
        members=(name,),
    )


_MODULES = (
    module_row(
        "sim",
        publishes=(
            topics.CLOCK,
            topics.PAUSED,
            topics.PRESENCE,
            topics.TRUE_POSE,
            topics.TRUE_TOWN,
            topics.ENERGY,
            topics.ODOMETRY,
            topics.STEREO,
            topics.SELF_MOTION,
            topics.SCAN,
            topics.PERCEPTS,
        ),
        subscribes=(topics.MOTOR_COMMAND, topics.PAUSE, topics.RESET, topics.STREET_CLOSURE),
    ),
    module_row(
        "player",
        publishes=(
            topics.CLOCK,
            topics.PAUSED,
            topics.PRESENCE,
            topics.TRUE_POSE,
            topics.TRUE_TOWN,
            topics.PLAYBACK,
            topics.ENERGY,
            topics.ODOMETRY,
            topics.STEREO,
            topics.SELF_MOTION,
            topics.SCAN,
            topics.PERCEPTS,
        ),
        subscribes=(topics.MOTOR_COMMAND, topics.PAUSE),
    ),
    module_row(
        "sensory",
        publishes=(topics.SELF_MOTION, topics.SCAN, topics.VIEW),
        subscribes=(topics.STEREO, topics.ODOMETRY),
    ),
    module_row(
        "epam",
        publishes=(topics.PERCEPTS, topics.LEARNED),
        subscribes=(topics.VIEW, topics.COMPETITION, topics.BROADCAST),
    ),
    module_row(
        "workspace",
        publishes=(
            topics.TASK,
            topics.LEASES,
            topics.DELTA,
            topics.REPLAY,
            topics.ROUTE_REPLAY,
            topics.COALITIONS,
            topics.PRESENCE,
        ),
        subscribes=(
            topics.SELF_MOTION,
            topics.SCAN,
            topics.ENERGY,
            topics.PERCEPTS,
            topics.PROPOSAL,
            topics.OFFER,
            topics.COMPETITION,
            topics.BROADCAST,
            topics.CLOCK,
            topics.HEALTH,
        ),
        answers=(topics.SNAPSHOT_REQUEST,),
    ),
    module_row(
        "codelets",
        publishes=(topics.PROPOSAL,),
        subscribes=(topics.DELTA, topics.TASK, topics.LEASES),
    ),
    module_row(
        "global_workspace",
        publishes=(topics.COMPETITION, topics.BROADCAST),
        subscribes=(topics.COALITIONS,),
    ),
    module_row(
        "memory",
        publishes=(topics.STORED, topics.OFFER),
        subscribes=(
            topics.SCAN,
            topics.DELTA,
            topics.COMPETITION,
            topics.BROADCAST,
            topics.RESTORED,
        ),
        remembers=True,
    ),
    module_row(
        "procedural",
        publishes=(topics.BEHAVIOURS,),
        subscribes=(topics.DELTA, topics.BROADCAST, topics.ACTION),
    ),
    module_row("action", publishes=(topics.ACTION,), subscribes=(topics.BEHAVIOURS,)),
    module_row(
        "motor",
        publishes=(topics.MOTOR_PROGRAM, topics.MOTOR_COMMAND, topics.OFFER),
        subscribes=(
            topics.SELF_MOTION,
            topics.SCAN,
            topics.DELTA,
            topics.COMPETITION,
            topics.ACTION,
            topics.CLOCK,
        ),
    ),
)

_ROLES = (
    Subject(
        OPERATOR,
        publishes=frozenset(
            {
                topics.OFFER,
                topics.STREET_CLOSURE,
                topics.RESET,
                topics.PAUSE,
                topics.MOTOR_COMMAND,
                topics.HEALTH,
            }
        ),
        subscribes=_ALL,
        asks=_REQUESTS,
        members=(*_CLI, "dashboard", "goal", "name", "notebook", "motor/teleop"),
        discovers=True,
    ),
    Subject(
        OBSERVER, subscribes=_ALL, asks=_REQUESTS, members=(*_CLI, "dashboard"), discovers=True
    ),
    Subject(RECORDER, subscribes=_STREAMED, members=("recorder",)),
    # The process of `cogmap run`, which watches its drive and guides a tour.
    Subject(
        DRIVE,
        publishes=frozenset({topics.OFFER, topics.STREET_CLOSURE}),
        subscribes=_STREAMED,
        asks=_REQUESTS,
        members=("observer",),
    ),
    # A log that is played onto a bus is every module that it holds.
    Subject(REPLAY, publishes=_STREAMED, members=("replay",)),
    # A robot that runs ROS 2, in the place of sim, and what it is shown of the map.
    Subject(
        ROS2,
        publishes=frozenset(
            {
                topics.CLOCK,
                topics.STEREO,
                topics.ODOMETRY,
                topics.SELF_MOTION,
                topics.SCAN,
                topics.PERCEPTS,
                topics.PLAYBACK,
                topics.HEALTH,
            }
        ),
        subscribes=frozenset({topics.MOTOR_COMMAND, topics.DELTA}),
        asks=frozenset({topics.SNAPSHOT_REQUEST}),
        members=("sim/ros2", "ros2_map"),
        discovers=True,
    ),
    # The router's own process, which ends with its drive.
    Subject(ROUTER),
)

SUBJECTS: dict[str, Subject] = {subject.name: subject for subject in (*_MODULES, *_ROLES)}
