"""The one table of topics. Nothing else spells a topic's name or a key expression."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from cogmap.schemas import codelets, cognition, graph, memory, process, sensing
from cogmap.schemas.base import Message

KIB = 1024
MIB = 1024 * KIB


class Delivery(enum.Enum):
    """LATEST_WINS: a slow subscriber sees the newest. NEVER_DROP: every subscriber gets every
    message, in order.
    """

    LATEST_WINS = "latest wins"
    NEVER_DROP = "never drop"
    ON_REQUEST = "on request"


class Scope(enum.Enum):
    """MODEL: what the agent senses, thinks and does, the same bytes for the same seed in lockstep.

    PROCESS: how the processes fare, which differs from run to run. TRUTH: the simulator's or the
    recording's; no module may subscribe.
    """

    MODEL = "model"
    PROCESS = "process"
    TRUTH = "truth"


@dataclass(frozen=True, eq=False)
class Topic:
    """A row of the table: `rate_hz` as in the default configuration, 0 if it depends on what
    happens.

    Latency is counted from the messages that are `sensed`: they derive from the world, not from
    other messages. Several modules may publish one that is `shared` at once; of any other the
    messages of a second publisher would contradict those of the first.
    """

    name: str
    type: type[Message]
    rate_hz: float
    delivery: Delivery
    scope: Scope = Scope.MODEL
    max_bytes: int = MIB
    keep_in_log: bool = True
    sensed: bool = False
    shared: bool = False

    @property
    def carries_images(self) -> bool:
        """Return whether its messages are images: large, each in the place of the one before."""
        return self.max_bytes > MIB and self.delivery is Delivery.LATEST_WINS

    def key(self, agent: str) -> str:
        """Return the Zenoh key expression of this topic for `agent`."""
        return f"cogmap/{agent}/{self.name}"

    @property
    def file_stem(self) -> str:
        """Return the name of a file about this topic, without a suffix."""
        return self.name.replace("/", ".")


_LATEST = Delivery.LATEST_WINS
_NEVER = Delivery.NEVER_DROP
_REQUEST = Delivery.ON_REQUEST

CLOCK = Topic("clock", process.Clock, 20, _LATEST, sensed=True)
STEREO = Topic("camera/stereo", sensing.StereoFrame, 5, _LATEST, max_bytes=32 * MIB, sensed=True)
ODOMETRY = Topic("odometry", sensing.Odometry, 20, _NEVER, sensed=True)
SELF_MOTION = Topic("sensory/motion", sensing.SelfMotion, 5, _NEVER)
ENERGY = Topic("body/energy", sensing.Energy, 5, _NEVER, sensed=True)
VIEW = Topic("sensory/view", sensing.View, 5, _LATEST, max_bytes=64 * MIB)
SCAN = Topic("sensory/scan", sensing.RangeScan, 5, _LATEST)
PERCEPTS = Topic("epam/percepts", sensing.Percepts, 5, _NEVER)
LEARNED = Topic("epam/learned", sensing.Learned, 0, _NEVER, max_bytes=64 * MIB)
TASK = Topic("workspace/task", codelets.Task, 0, _NEVER)
LEASES = Topic("workspace/leases", codelets.Leases, 0, _NEVER, Scope.PROCESS)
PROPOSAL = Topic("codelets/proposal", codelets.Proposal, 0, _NEVER, max_bytes=64 * MIB, shared=True)
OFFER = Topic("workspace/offer", codelets.Offer, 0, _NEVER, max_bytes=16 * MIB, shared=True)
DELTA = Topic("workspace/delta", graph.Delta, 0, _NEVER, max_bytes=64 * MIB)
SNAPSHOT = Topic("workspace/snapshot", graph.Snapshot, 0, _REQUEST, max_bytes=512 * MIB)
SNAPSHOT_REQUEST = Topic("workspace/snapshot_request", graph.SnapshotRequest, 0, _REQUEST)
REPLAY = Topic("workspace/replay", cognition.Replay, 0, _NEVER, max_bytes=16 * MIB)
ROUTE_REPLAY = Topic("workspace/route_replay", cognition.RouteReplay, 0, _NEVER)
COALITIONS = Topic("workspace/coalitions", cognition.Coalitions, 5, _NEVER)
COMPETITION = Topic("global_workspace/competition", cognition.Competition, 5, _NEVER)
BROADCAST = Topic("global_workspace/broadcast", cognition.Broadcast, 0, _NEVER)
STORED = Topic("memory/stored", memory.Stored, 0, _NEVER, max_bytes=64 * MIB)
RESTORED = Topic("memory/restored", memory.Restored, 0, _NEVER, max_bytes=512 * MIB, shared=True)
BEHAVIOURS = Topic("procedural/behaviours", cognition.Behaviours, 0, _NEVER, max_bytes=16 * MIB)
ACTION = Topic("action/selected", cognition.Action, 0, _NEVER)
MOTOR_PROGRAM = Topic("motor/program", cognition.MotorProgram, 0, _NEVER)
MOTOR_COMMAND = Topic("motor/command", sensing.MotorCommand, 5, _NEVER)
STREET_CLOSURE = Topic("sim/street", sensing.StreetClosure, 0, _NEVER, shared=True)
RESET = Topic("sim/reset", sensing.Reset, 0, _NEVER, shared=True)
PAUSE = Topic("sim/pause", process.Pause, 0, _NEVER, Scope.PROCESS, shared=True)
PAUSED = Topic("sim/paused", process.Paused, 0, _NEVER, Scope.PROCESS)
TRUE_POSE = Topic("truth/pose", sensing.TruePose, 20, _LATEST, Scope.TRUTH, sensed=True)
TRUE_TOWN = Topic(
    "truth/town",
    sensing.TrueTown,
    0.2,
    _NEVER,
    Scope.TRUTH,
    max_bytes=16 * MIB,
    sensed=True,
)
PLAYBACK = Topic("truth/playback", process.Playback, 0, _NEVER, Scope.TRUTH, sensed=True)
PRESENCE = Topic("presence", process.Presence, 0, _NEVER, Scope.PROCESS, shared=True)
HEALTH = Topic("health", process.Health, 0, _LATEST, Scope.PROCESS, shared=True)
SETTINGS = Topic("settings", process.Settings, 0, _REQUEST, Scope.PROCESS)
SETTINGS_REQUEST = Topic("settings_request", process.SettingsRequest, 0, _REQUEST, Scope.PROCESS)

ALL: tuple[Topic, ...] = tuple(
    value for value in list(globals().values()) if isinstance(value, Topic)
)
BY_NAME: dict[str, Topic] = {topic.name: topic for topic in ALL}
BY_TYPE: dict[type[Message], Topic] = {topic.type: topic for topic in ALL}


def of(message: Message) -> Topic:
    """Return the topic that `message` travels on: there is one for each type."""
    return BY_TYPE[type(message)]
