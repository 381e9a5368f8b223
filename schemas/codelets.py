"""The messages by which codelets are given work and answer it, and others offer theirs."""

from __future__ import annotations

from cogmap.schemas.array import Array
from cogmap.schemas.base import Count, Message, Name, Part
from cogmap.schemas.cognition import Coalition, Event
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import NEVER_NS
from cogmap.schemas.nodes.base import Stamp
from cogmap.schemas.sensing import Percept, PlaceMatch


class Task(Message, kw_only=True, frozen=True):
    """Work for one codelet: what it is about, and what was sensed. All else is in the graph.

    It reads the graph at `version`, or newer. `about` are ids of nodes. `motions` is as in
    SelfMotion, from `since_ns` on: of an agent that was moved later the beginning is done already.
    `road_m` and `road_boundary_m` are as in Percepts. `scan`, float32 (n, 2), has bearing and range
    of each ray of the view's RangeScan; range 0 is nothing seen.
    """

    task_id: Name
    codelet: Name
    cycle: Count
    version: Count
    about: list[Name] = []
    percepts: list[Percept] = []
    matches: list[PlaceMatch] = []
    motions: Array | None = None
    since_ns: Stamp = NEVER_NS
    road_m: Array | None = None
    road_boundary_m: Array | None = None
    scan: Array | None = None


class Assignment(Part, kw_only=True, frozen=True):
    """That `worker` holds a task until its lease ends."""

    task_id: Name
    worker: Name
    attempt: Count
    version: Count


class Leases(Message, kw_only=True, frozen=True):
    """Which workers hold which tasks, of those published just before."""

    assignments: list[Assignment]


class Proposal(Message, kw_only=True, frozen=True):
    """A codelet's answer to a task, of what it read in the graph at `base_version`.

    The workspace commits `operations`, and then publishes `coalitions` and `events`.
    """

    task_id: Name
    codelet: Name
    base_version: Count
    operations: list[Operation] = []
    coalitions: list[Coalition] = []
    events: list[Event] = []
    failure: str = ""


class Offer(Message, kw_only=True, frozen=True):
    """Operations that no task asked for: a goal from a person, a recall from memory.

    They are committed at the start of the next cycle, in order of source and number. `cycle` is the
    newest cycle that its source had seen end.
    """

    cycle: Count
    operations: list[Operation]
