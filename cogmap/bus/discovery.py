"""Which process publishes, subscribes and answers what, as the router of a system reports it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

import msgspec
import zenoh

from cogmap.bus.interface import Member
from schemas import topics
from schemas.topics import Topic

ANSWER_TIMEOUT_S = 2.0


class Role(Enum):
    """What a process does on a key, by the router's name for it."""

    PUBLISHES = "publisher"
    SUBSCRIBES = "subscriber"
    ANSWERS = "queryable"


_ROLES = {role.value: role for role in Role}


@dataclass(frozen=True, order=True)
class Process:
    """A session with the router. `member` is None while it has not named itself."""

    zid: str
    member: Member | None = None

    @property
    def name(self) -> str:
        """Its instance, or `?` and the beginning of its session's id where it has no name."""
        return self.member.instance if self.member is not None else f"?{self.zid[:8]}"


@dataclass(frozen=True)
class Use:
    """That `process` does `role` on `key`, a key expression."""

    key: str
    role: Role
    process: Process


@dataclass(frozen=True)
class System:
    """All that one agent's processes do on the bus, without the one that asks."""

    agent: str
    processes: tuple[Process, ...]
    uses: tuple[Use, ...]

    def doing(self, role: Role, topic: Topic) -> list[Process]:
        """The processes with that role on `topic`, by name.

        One whose key expression covers several topics is among those of each.
        """
        key = zenoh.KeyExpr(topic.key(self.agent))
        found = set()
        for use in self.uses:
            if use.role is role and key.intersects(zenoh.KeyExpr(use.key)):
                found.add(use.process)
        return sorted(found, key=_by_name)

    def topics(self) -> list[Topic]:
        """The topics that some process has a role on, in the order of the table."""
        return [topic for topic in topics.ALL if any(self.doing(role, topic) for role in Role)]

    def foreign_keys(self) -> list[str]:
        """Keys in use that are no topic's: of another version, or another program."""
        known = [zenoh.KeyExpr(topic.key(self.agent)) for topic in topics.ALL]
        foreign = []
        for key in sorted({use.key for use in self.uses}):
            expression = zenoh.KeyExpr(key)
            if not any(topic_key.intersects(expression) for topic_key in known):
                foreign.append(key)
        return foreign


class _Clients(msgspec.Struct):
    """What the router's admin space holds under a key: the sessions that have the role."""

    clients: list[str]


def identity_key(agent: str, zid: str, member: Member) -> str:
    """The key of the liveliness token that names session `zid`."""
    return f"cogmap/{agent}/@session/{zid}/{member.module}/{member.instance}"


def identify(session: zenoh.Session, agent: str, member: Member) -> zenoh.LivelinessToken:
    """Name `session` as `member`'s; it holds until the token is undeclared."""
    return session.liveliness().declare_token(identity_key(agent, str(session.zid()), member))


def discover(session: zenoh.Session, agent: str) -> System:
    """What `agent`'s processes do at this moment."""
    every_token = identity_key(agent, "*", Member("*", "*"))
    named = session.liveliness().get(every_token, timeout=ANSWER_TIMEOUT_S)
    tokens = [str(sample.key_expr) for sample in _samples(named)]

    admin = session.get("@/*/router/**", timeout=ANSWER_TIMEOUT_S)
    facts = [(str(sample.key_expr), bytes(sample.payload)) for sample in _samples(admin)]
    return read(agent, tokens, facts, str(session.zid()))


def _samples(replies: Iterable[zenoh.Reply]) -> list[zenoh.Sample]:
    """The replies that are no errors."""
    return [reply.ok for reply in replies if reply.ok is not None]


def read(
    agent: str, tokens: Iterable[str], facts: Iterable[tuple[str, bytes]], own_zid: str = ""
) -> System:
    """The system that identity tokens and the routers' `facts` (admin key, JSON) describe.

    The session `own_zid` is left out.
    """
    members: dict[str, Member] = {}
    for token in tokens:
        *_, zid, module, instance = token.split("/")
        members[zid] = Member(module, instance)

    uses: set[Use] = set()
    for admin_key, payload in facts:
        uses |= _uses(agent, members, admin_key, payload)
    uses = {use for use in uses if use.process.zid != own_zid}

    processes = {use.process for use in uses}
    for zid, member in members.items():
        if zid != own_zid:
            processes.add(Process(zid, member))
    return System(
        agent,
        tuple(sorted(processes, key=_by_name)),
        tuple(sorted(uses, key=lambda use: (use.key, use.role.value, use.process.zid))),
    )


def _uses(agent: str, members: dict[str, Member], admin_key: str, payload: bytes) -> set[Use]:
    """The uses of `agent`'s keys in one fact, such as `@/ZID/router/publisher/KEY`."""
    path = admin_key.split("/", 3)[-1]
    word, _, key = path.partition("/")
    role = _ROLES.get(word)
    is_ours = key.startswith((f"cogmap/{agent}/", "*"))
    if role is None or not is_ours:
        return set()

    zids = msgspec.json.decode(payload, type=_Clients).clients
    return {Use(key, role, Process(zid, members.get(zid))) for zid in zids}


def _by_name(process: Process) -> tuple[str, str]:
    return process.name, process.zid
