"""The lies that there are to tell: of every topic each kind that it can be told of."""

from __future__ import annotations

import enum
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from benchmarks.campaign.listener import CARRIED
from cogmap.errors import UsageError
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic
from cogmap.services import registry


class Kind(enum.StrEnum):
    """What is not true of a forged message; GHOST and SECOND_INSTANCE are of a module."""

    FAR_STAMP = "far-stamp"
    OLD_STAMP = "old-stamp"
    NEGATIVE_STAMP = "negative-stamp"
    FAR_CYCLE = "far-cycle"
    FAR_VERSION = "far-version"
    FAR_NUMBER = "far-number"
    OTHER_SOURCE = "other-source"
    NEW_INCARNATION = "new-incarnation"
    FLOOD = "flood"
    GHOST = "ghost-token"
    SECOND_INSTANCE = "second-instance"


class Mode(enum.StrEnum):
    """How the time of the drive passes."""

    LOCKSTEP = "lockstep"
    REAL_TIME = "real-time"


FIELDS = {Kind.FAR_CYCLE: ("cycle",), Kind.FAR_VERSION: ("version", "base_version", "at_least")}
"""Fields of which a message must have one, so that the kind of lie can be told of it."""

OF_MODULES = (Kind.GHOST, Kind.SECOND_INSTANCE)
OF_PEOPLE = (topics.STREET_CLOSURE, topics.RESET, topics.PAUSE, topics.OFFER)
"""People may publish these, under any name, and know no time of the agent's: that is no lie."""

ANSWERED = {
    topics.SNAPSHOT: (Kind.FAR_STAMP, Kind.FAR_CYCLE, Kind.FAR_VERSION, Kind.OTHER_SOURCE),
    topics.SNAPSHOT_REQUEST: (Kind.FAR_VERSION, Kind.FLOOD),
    topics.SETTINGS_REQUEST: (Kind.FLOOD,),
}
"""The lies about what is asked for and answered: a stranger asks, or answers. Settings are answered
to people alone.
"""

TOLD_AS_ONESELF = (Kind.OTHER_SOURCE, Kind.NEW_INCARNATION)


@dataclass(frozen=True, order=True)
class Case:
    """A lie of some kind about `subject`, the name of a topic or of a module."""

    subject: str
    kind: Kind
    mode: Mode

    def __str__(self) -> str:
        return f"{self.subject}/{self.kind}/{self.mode}"

    @property
    def topic(self) -> Topic | None:
        """Return its topic; None if it is about a module."""
        return topics.BY_NAME.get(self.subject) if self.kind not in OF_MODULES else None


def every(modes: Iterable[Mode]) -> list[Case]:
    """Return all cases, in the order of modes and topics, the modules' last."""
    found = []
    for mode in modes:
        for topic in (*CARRIED, *ANSWERED):
            found += [Case(topic.name, kind, mode) for kind in kinds_of(topic)]
        for module in registry.taking_part():
            found += [Case(module, kind, mode) for kind in OF_MODULES]
    return found


def kinds_of(topic: Topic) -> list[Kind]:
    """Return the lies that can be told on a topic."""
    if topic.delivery is Delivery.ON_REQUEST:
        return list(ANSWERED.get(topic, ()))

    found = []
    for kind in Kind:
        fields = FIELDS.get(kind)
        has_field = fields is None or any(field in topic.type.__struct_fields__ for field in fields)
        is_allowed = topic in OF_PEOPLE and kind in (Kind.OLD_STAMP, *TOLD_AS_ONESELF)
        if has_field and not is_allowed and kind not in OF_MODULES:
            found.append(kind)
    return found


def selected(
    cases: Sequence[Case], number: int | None, seed: int, only: Sequence[str]
) -> list[Case]:
    """Return those of `only`, SUBJECT, /KIND or SUBJECT/KIND, all if it is empty; of them `number`,
    drawn by `seed`, in their order. Raises UsageError if one of `only` is none of the cases.
    """
    wanted = list(cases)
    if only:
        for each in only:
            if not any(_is_of(case, each) for case in cases):
                raise UsageError(
                    f"--only {each}: no case has that name: write TOPIC/KIND, TOPIC or /KIND, such "
                    f"as clock/{Kind.FAR_STAMP}, with a kind of {', '.join(Kind)}"
                )
        wanted = [case for case in cases if any(_is_of(case, each) for each in only)]

    if number is None or number >= len(wanted):
        return wanted
    drawn = random.Random(seed).sample(range(len(wanted)), number)
    return [wanted[place] for place in sorted(drawn)]


def _is_of(case: Case, name: str) -> bool:
    subject, kind = case.subject, case.kind
    return name in (subject, f"/{kind}", f"{subject}/{kind}", str(case))
