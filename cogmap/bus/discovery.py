"""Which process publishes, takes in and answers what on a running system, as its router tells."""

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
    """What a process does on a key, as the router calls it."""

    PUBLISHES = "publisher"
    SUBSCRIBES = "subscriber"
    ANSWERS = "queryable"


@dataclass(frozen=True, order=True)
class Process:
    """A session with the router. `member` is None while it has not said who it is."""

    zid: str
    member: Member | None = None

    @property
    def name(self) -> str:
        """What to call it: its instance, or its session where it has no name."""
        return self.member.instance if self.member is not None else f"?{self.zid[:8]}"


@dataclass(frozen=True)
class Use:
    """That `process` does `role` on `key`, a key expression."""

    key: str
    role: Role
    process: Process


@dataclass(frozen=True)
class System:
    """All that one agent's processes do on the bus. Whoever asks is not in it."""

    agent: str
    processes: tuple[Process, ...]
    uses: tuple[Use, ...]

    def doing(self, role: Role, topic: Topic) -> list[Process]:
        """The processes with that role on `topic`, by name; one on many topics at once counts for
        each.
        """
        key = zenoh.KeyExpr(topic.key(self.agent))
        found = {
            use.process
            for use in self.uses
            if use.role is role and key.intersects(zenoh.KeyExpr(use.key))
        }
        return sorted(found, key=lambda process: (process.name, process.zid))

    def topics(self) -> list[Topic]:
        """The topics that somebody does something on, in the order of the table."""
        return [topic for topic in topics.ALL if any(self.doing(role, topic) for role in Role)]

    def foreign_keys(self) -> list[str]:
        """Keys in use that are no topic's: of an older or newer version, or another program."""
        known = [zenoh.KeyExpr(topic.key(self.agent)) for topic in topics.ALL]
        keys = {use.key for use in self.uses}
        return sorted(
            key for key in keys if not any(other.intersects(zenoh.KeyExpr(key)) for other in known)
        )


class _Clients(msgspec.Struct):
    clients: list[str]


def identity_key(agent: str, zid: str, member: Member) -> str:
    """The key of the liveliness token that says who session `zid` is."""
    return f"cogmap/{agent}/@session/{zid}/{member.module}/{member.instance}"


def identify(session: zenoh.Session, agent: str, member: Member) -> zenoh.LivelinessToken:
    """Tell everybody that `session` is `member`'s; it holds until the token is undeclared."""
    return session.liveliness().declare_token(identity_key(agent, str(session.zid()), member))


def discover(session: zenoh.Session, agent: str) -> System:
    """What `agent`'s processes do at this moment."""
    tokens = session.liveliness().get(
        identity_key(agent, "*", Member("*", "*")), timeout=ANSWER_TIMEOUT_S
    )
    keys = [str(reply.ok.key_expr) for reply in tokens if reply.ok is not None]
    replies = session.get("@/*/router/**", timeout=ANSWER_TIMEOUT_S)
    facts = [
        (str(reply.ok.key_expr), bytes(reply.ok.payload))
        for reply in replies
        if reply.ok is not None
    ]
    return read(agent, keys, facts, str(session.zid()))


def read(
    agent: str, tokens: Iterable[str], facts: Iterable[tuple[str, bytes]], own_zid: str = ""
) -> System:
    """The system that identity tokens and the routers' (admin key, JSON) `facts` describe, without
    `own_zid`.
    """
    members: dict[str, Member] = {}
    for token in tokens:
        *_, zid, module, instance = token.split("/")
        members[zid] = Member(module, instance)
    uses: set[Use] = set()
    for admin_key, payload in facts:
        role, _, key = admin_key.split("/", 3)[-1].partition("/")
        if _is_role(role) and key.startswith((f"cogmap/{agent}/", "*")):
            clients = msgspec.json.decode(payload, type=_Clients).clients
            uses |= {
                Use(key, Role(role), Process(zid, members.get(zid)))
                for zid in clients
                if zid != own_zid
            }
    named = {Process(zid, member) for zid, member in members.items() if zid != own_zid}
    processes = named | {use.process for use in uses}
    return System(
        agent,
        tuple(sorted(processes, key=lambda process: (process.name, process.zid))),
        tuple(sorted(uses, key=lambda use: (use.key, use.role.value, use.process.zid))),
    )


def _is_role(word: str) -> bool:
    return word in {role.value for role in Role}
