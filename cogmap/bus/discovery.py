"""Discovers which process publishes, subscribes to and answers what, as each announces it itself.

Each announces its name and each of its uses by a liveliness token. The router's admin space, which
would tell the same, is not asked: it answers under the lock of the routing tables, and a query that
meets a declaration stops the router for good (eclipse-zenoh/zenoh#2619).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

import zenoh

from cogmap.bus.interface import Member
from cogmap.bus.session import ready_key
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic

# How long the tokens of all members may take to come.
ANSWER_TIMEOUT_S = 2.0
# By default a query's channel has room for 256 tokens, and the next one blocks the session.
MAX_TOKENS = 65_536
NO_ZID = ""
# A topic's name, the last part of a use's key, may have slashes of its own.
USE_PARTS = 5


class Role(Enum):
    """What a process does on a topic."""

    PUBLISHES = "publisher"
    SUBSCRIBES = "subscriber"
    ANSWERS = "queryable"


ROLES = {role.value: role for role in Role}


@dataclass(frozen=True, order=True)
class Process:
    """A session with the router. `member` is None while it has not named itself."""

    zid: str
    member: Member | None = None

    @property
    def name(self) -> str:
        """Return its instance, or `?` and the beginning of its session's id if it has no name."""
        return self.member.instance if self.member is not None else f"?{self.zid[:8]}"


@dataclass(frozen=True)
class Use:
    """That `process` does `role` on the topic of that name."""

    topic_name: str
    role: Role
    process: Process


@dataclass(frozen=True)
class System:
    """All that one agent's processes do on the bus, without the one that asks."""

    agent: str
    processes: tuple[Process, ...]
    uses: tuple[Use, ...]

    def doing(self, role: Role, topic: Topic) -> list[Process]:
        """Return the processes with that role on `topic`, by name."""
        found = set()
        for use in self.uses:
            if use.role is role and use.topic_name == topic.name:
                found.add(use.process)
        return sorted(found, key=_by_name)

    def topics(self) -> list[Topic]:
        """Return the topics that some process has a role on, in the order of the table."""
        return [topic for topic in topics.ALL if any(self.doing(role, topic) for role in Role)]

    def unknown_topics(self) -> list[str]:
        """Return the names in use that are no topic's: they are of another version."""
        known = {topic.name for topic in topics.ALL}
        return sorted({use.topic_name for use in self.uses} - known)


def identity_key(agent: str, zid: str, member: Member) -> str:
    """Return the key of the liveliness token that names session `zid`."""
    return f"cogmap/{agent}/@session/{zid}/{member.module}/{member.instance}"


def use_key(agent: str, zid: str, role: str, topic_name: str) -> str:
    """Return the key of the liveliness token of what session `zid` does on a topic."""
    return f"cogmap/{agent}/@use/{zid}/{role}/{topic_name}"


def identify(session: zenoh.Session, agent: str, member: Member) -> zenoh.LivelinessToken:
    """Name `session` as `member`'s; it holds until the token is undeclared."""
    return session.liveliness().declare_token(identity_key(agent, str(session.zid()), member))


def announce_use(
    session: zenoh.Session, agent: str, role: Role, topic: Topic
) -> zenoh.LivelinessToken:
    """Say what `session` does on `topic`; it holds until the token is undeclared."""
    key = use_key(agent, str(session.zid()), role.value, topic.name)
    return session.liveliness().declare_token(key)


def discover(session: zenoh.Session, agent: str) -> System:
    """Return what `agent`'s processes do at this moment."""
    every_member = Member("*", "*")
    return read(
        agent,
        named=tokens(session, identity_key(agent, "*", every_member)),
        used=tokens(session, use_key(agent, "*", "*", "**")),
        ready=tokens(session, ready_key(agent, every_member)),
        own_zid=str(session.zid()),
    )


def tokens(session: zenoh.Session, expression: str) -> list[str]:
    """Return the keys of the liveliness tokens that are there."""
    channel: zenoh.handlers.FifoChannel[zenoh.Reply] = zenoh.handlers.FifoChannel(MAX_TOKENS)
    replies = session.liveliness().get(expression, channel, timeout=ANSWER_TIMEOUT_S)
    return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]


def read(
    agent: str,
    named: Iterable[str] = (),
    used: Iterable[str] = (),
    ready: Iterable[str] = (),
    own_zid: str = NO_ZID,
) -> System:
    """Return the system that the keys of liveliness tokens describe, without the session `own_zid`.

    A member that is ready and does not name its session, as one in another language may, is a
    process too.
    """
    members: dict[str, Member] = {}
    for token in named:
        *_, zid, module, instance = token.split("/")
        members[zid] = Member(module, instance)

    uses = set()
    for token in used:
        *_, zid, word, topic_name = token.split("/", USE_PARTS)
        role = ROLES.get(word)
        if role is not None and zid != own_zid:
            uses.add(Use(topic_name, role, Process(zid, members.get(zid))))

    processes = {use.process for use in uses}
    for zid, member in members.items():
        if zid != own_zid:
            processes.add(Process(zid, member))

    for token in ready:
        *_, module, instance = token.split("/")
        member = Member(module, instance)
        if member not in members.values():
            processes.add(Process(NO_ZID, member))
    return System(
        agent,
        tuple(sorted(processes, key=_by_name)),
        tuple(sorted(uses, key=lambda use: (use.topic_name, use.role.value, use.process.zid))),
    )


def _by_name(process: Process) -> tuple[str, str]:
    return process.name, process.zid
