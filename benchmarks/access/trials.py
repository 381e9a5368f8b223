"""What each holder of a certificate achieves on each topic, against what the table allows it."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any, NamedTuple

import zenoh

from benchmarks.access.grounds import AGENT, Grounds
from cogmap.bus.access.subjects import Subject
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic

AWAITED_S = 5.0
"""Time for what is allowed to happen; on a busy machine it takes a part of that."""

SETTLE_S = 0.3
"""Time after that for what is denied to happen all the same."""

ANSWER_S = 1.0
POLL_S = 0.02
FORGER = "forger"
_KINDS = ("@ready", "@incarnation", "@session", "@use")
NOBODY = Subject("nobody")
_KEPT = [topic for topic in topics.ALL if topic.delivery is Delivery.NEVER_DROP]

Deeds = dict[str, bool]
"""Whether each deed is allowed, by a name such as `publish motor/command`."""


class Trial(NamedTuple):
    """A deed that somebody tried: whether it is allowed, and whether it was achieved."""

    who: str
    deed: str
    is_allowed: bool
    is_achieved: bool


def trials_of(who: str, subject: Subject, party: zenoh.Session, place: Grounds) -> list[Trial]:
    """Try everything as `party`, whom the table knows as `subject`."""
    found = []
    for attempt in (_publish, _subscribe, _ask, _answer, _announce, _see):
        allowed, achieved = attempt(who, subject, party, place.witness)
        found += [Trial(who, deed, is_ok, deed in achieved) for deed, is_ok in allowed.items()]
    return found


def shut_out(who: str, subject: Subject) -> list[Trial]:
    """Return the trials of somebody whom the router does not let in: none is achieved."""
    found = []
    for allowed in (_publishing, _subscribing, _asking, _answering, _announcing, _seeing):
        found += [Trial(who, deed, is_ok, False) for deed, is_ok in allowed(subject).items()]
    return found


def _publishing(subject: Subject) -> Deeds:
    allowed = {f"publish {topic.name}": topic in subject.publishes for topic in topics.ALL}
    return allowed | {f"delete {topic.name}": False for topic in topics.ALL}


def _publish(
    who: str, subject: Subject, party: zenoh.Session, witness: zenoh.Session
) -> tuple[Deeds, set[str]]:
    """Put and delete on every topic; the witness subscribes to all."""
    allowed = _publishing(subject)
    achieved: set[str] = set()

    def receive(sample: zenoh.Sample) -> None:
        verb = "publish" if sample.kind == zenoh.SampleKind.PUT else "delete"
        achieved.add(f"{verb} {_name_of(sample.key_expr)}")

    subscribers = [witness.declare_subscriber(_key(topic), receive) for topic in topics.ALL]
    _meet(witness)
    for topic in topics.ALL:
        party.delete(_key(topic))
        party.put(_key(topic), who)
    _settle(allowed, achieved)
    _undeclare(subscribers)
    return allowed, achieved


def _subscribing(subject: Subject) -> Deeds:
    return {f"subscribe {topic.name}": topic in subject.subscribes for topic in topics.ALL}


def _subscribe(
    who: str, subject: Subject, party: zenoh.Session, witness: zenoh.Session
) -> tuple[Deeds, set[str]]:
    """Subscribe to every topic, and to all at once; the witness publishes."""
    allowed = _subscribing(subject)
    achieved: set[str] = set()

    def receive(sample: zenoh.Sample) -> None:
        achieved.add(f"subscribe {_name_of(sample.key_expr)}")

    keys = [*(_key(topic) for topic in topics.ALL), f"cogmap/{AGENT}/**", "**"]
    subscribers = [party.declare_subscriber(key, receive) for key in keys]
    _meet(party)
    until_s = time.monotonic() + AWAITED_S
    while not _done(allowed) <= achieved and time.monotonic() < until_s:
        for topic in topics.ALL:
            witness.put(_key(topic), who)
        time.sleep(POLL_S)
    time.sleep(SETTLE_S)
    _undeclare(subscribers)
    return allowed, achieved


def _asking(subject: Subject) -> Deeds:
    allowed = {f"ask {topic.name}": topic in subject.asks for topic in topics.ALL}
    for topic in _KEPT:
        allowed[f"fetch {topic.name}"] = topic in subject.subscribes
        allowed[f"fetch the past of {topic.name}"] = topic in subject.subscribes
    return allowed


def _ask(
    who: str, subject: Subject, party: zenoh.Session, witness: zenoh.Session
) -> tuple[Deeds, set[str]]:
    """Ask each topic, and each cache of a publisher; the witness answers."""
    allowed = _asking(subject)
    asked = {f"ask {topic.name}": _key(topic) for topic in topics.ALL}
    asked |= {f"fetch {topic.name}": f"{_key(topic)}/@adv/**" for topic in _KEPT}
    asked |= {f"fetch the past of {topic.name}": _past_key(topic, "w") for topic in _KEPT}
    answering = {_key(topic): _key(topic) for topic in topics.ALL}
    answering |= {_cache_key(topic, "w"): _key(topic) for topic in _KEPT}
    answering |= {_past_key(topic, "w"): _past_key(topic, "w") for topic in _KEPT}

    queryables = [_queryable(witness, key, reply, "w") for key, reply in answering.items()]
    _meet(witness)
    achieved = _answered(party, asked, "w", allowed)
    _undeclare(queryables)
    return allowed, achieved


def _answering(subject: Subject) -> Deeds:
    allowed = {f"answer {topic.name}": topic in subject.answers for topic in topics.ALL}
    for topic in _KEPT:
        allowed[f"keep {topic.name}"] = topic in subject.publishes
        allowed[f"keep the past of {topic.name}"] = topic in subject.publishes
    return allowed


def _answer(
    who: str, subject: Subject, party: zenoh.Session, witness: zenoh.Session
) -> tuple[Deeds, set[str]]:
    """Answer each topic, and keep a cache of each; the witness asks."""
    allowed = _answering(subject)
    answering = {_key(topic): _key(topic) for topic in topics.ALL}
    answering |= {_cache_key(topic, FORGER): _key(topic) for topic in _KEPT}
    answering |= {_past_key(topic, FORGER): _past_key(topic, FORGER) for topic in _KEPT}
    asked = {f"answer {topic.name}": _key(topic) for topic in topics.ALL}
    asked |= {f"keep {topic.name}": f"{_key(topic)}/@adv/**" for topic in _KEPT}
    asked |= {f"keep the past of {topic.name}": _past_key(topic, FORGER) for topic in _KEPT}

    queryables = [_queryable(party, key, reply, who) for key, reply in answering.items()]
    _meet(party)
    achieved = _answered(witness, asked, who, allowed)
    _undeclare(queryables)
    return allowed, achieved


def _announcing(subject: Subject) -> Deeds:
    return {deed: is_allowed for deed, (_, is_allowed) in _tokens(subject).items()}


def _tokens(subject: Subject) -> dict[str, tuple[str, bool]]:
    """Return the keys of tokens that are tried, and whether each is allowed, by deed."""
    found = {}
    for member in _MEMBERS:
        is_allowed = subject.may_be(member, FORGER)
        found[f"be {member}"] = (f"cogmap/{AGENT}/@ready/{member}/{FORGER}", is_allowed)
        found[f"be called {member}"] = (
            f"cogmap/{AGENT}/@session/{FORGER}/{member}/{FORGER}",
            is_allowed,
        )
        found[f"be an incarnation of {member}"] = (
            f"cogmap/{AGENT}/@incarnation/{member}/{FORGER}/1",
            is_allowed,
        )
    for topic in topics.ALL:
        use = f"cogmap/{AGENT}/@use/{FORGER}"
        found[f"claim to publish {topic.name}"] = (
            f"{use}/publisher/{topic.name}",
            topic in subject.publishes,
        )
        found[f"claim to subscribe {topic.name}"] = (
            f"{use}/subscriber/{topic.name}",
            topic in subject.subscribes,
        )
    for topic in _KEPT:
        is_allowed = topic in subject.publishes
        found[f"claim a cache of {topic.name}"] = (_cache_key(topic, FORGER), is_allowed)
    return found


_MEMBERS = (
    "sim",
    "sensory",
    "epam",
    "workspace",
    "codelets",
    "memory",
    "motor",
    "recorder",
    "observer",
    "cli",
    "goal",
)


def _announce(
    who: str, subject: Subject, party: zenoh.Session, witness: zenoh.Session
) -> tuple[Deeds, set[str]]:
    """Hold each token; the witness looks for them."""
    tried = _tokens(subject)
    allowed = _announcing(subject)
    deed_of = {key: deed for deed, (key, _) in tried.items()}
    achieved: set[str] = set()

    def see(sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT and key in deed_of:
            achieved.add(deed_of[key])

    watched = [f"cogmap/{AGENT}/{kind}/**" for kind in _KINDS]
    watched += [f"{_key(topic)}/@adv/pub/**" for topic in _KEPT]
    watching = [witness.liveliness().declare_subscriber(key, see, history=True) for key in watched]
    tokens = [party.liveliness().declare_token(key) for key in deed_of]
    _settle(allowed, achieved)
    _undeclare(tokens)
    _undeclare(watching)
    return allowed, achieved


def _seeing(subject: Subject) -> Deeds:
    is_known = subject is not NOBODY
    return {
        "see who is ready": is_known,
        "see incarnations": is_known,
        "see sessions": subject.discovers,
        "see uses": subject.discovers,
    }


def _see(
    who: str, subject: Subject, party: zenoh.Session, witness: zenoh.Session
) -> tuple[Deeds, set[str]]:
    """Look for the tokens of the witness."""
    allowed = _seeing(subject)
    kinds = dict(zip(allowed, _KINDS, strict=True))
    places = {
        "@ready": "sim/seen",
        "@incarnation": "sim/seen/1",
        "@session": "z/sim/seen",
        "@use": "z/publisher/odometry",
    }
    tokens = [
        witness.liveliness().declare_token(f"cogmap/{AGENT}/{kind}/{place}")
        for kind, place in places.items()
    ]
    _meet(witness)
    achieved = set()
    for deed, kind in kinds.items():
        replies = party.liveliness().get(f"cogmap/{AGENT}/{kind}/**", timeout=ANSWER_S)
        if any(reply.ok is not None for reply in replies):
            achieved.add(deed)
    _undeclare(tokens)
    return allowed, achieved


def _queryable(session: zenoh.Session, key: str, reply_key: str, payload: str) -> Any:
    def respond(query: zenoh.Query) -> None:
        with query:
            query.reply(reply_key, payload)

    return session.declare_queryable(key, respond)


def _answered(
    session: zenoh.Session, asked: dict[str, str], payload: str, allowed: Deeds
) -> set[str]:
    """Ask all at once, until all that is allowed was answered with `payload`."""
    achieved: set[str] = set()
    until_s = time.monotonic() + AWAITED_S
    while True:
        channels = {}
        for deed, key in asked.items():
            channels[deed] = session.get(
                key,
                timeout=ANSWER_S,
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                accept_replies=zenoh.ReplyKeyExpr.ANY,
            )
        for deed, replies in channels.items():
            found = [reply.ok for reply in replies if reply.ok is not None]
            if any(bytes(sample.payload) == payload.encode() for sample in found):
                achieved.add(deed)
        if _done(allowed) <= achieved or time.monotonic() > until_s:
            return achieved


def _settle(allowed: Deeds, achieved: set[str]) -> None:
    """Wait until all that is allowed has happened, and some time for what is not."""
    until_s = time.monotonic() + AWAITED_S
    while not _done(allowed) <= achieved and time.monotonic() < until_s:
        time.sleep(POLL_S)
    time.sleep(SETTLE_S)


def _done(allowed: Deeds) -> set[str]:
    return {deed for deed, is_allowed in allowed.items() if is_allowed}


def _meet(session: zenoh.Session) -> None:
    """Wait until the router has taken account of what a session has declared before."""
    for _reply in session.liveliness().get(f"cogmap/{AGENT}/@ready/**", timeout=ANSWER_S):
        pass


def _undeclare(declared: Iterable[Any]) -> None:
    for each in declared:
        each.undeclare()


def _key(topic: Topic) -> str:
    return topic.key(AGENT)


def _cache_key(topic: Topic, publisher: str) -> str:
    return f"{_key(topic)}/@adv/pub/{publisher}/1/_"


def _past_key(topic: Topic, source: str) -> str:
    return f"{_key(topic)}/@past/{source}"


def _name_of(key: object) -> str:
    return str(key).removeprefix(f"cogmap/{AGENT}/")
