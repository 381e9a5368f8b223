"""The router's access-control rules, made of the table of subjects: what is not allowed is denied.

A rule allows messages that come from a subject (ingress) or go to it (egress), with keys that its
own key expressions include. `**` includes no part of a key that begins with @, so each of those is
written out.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from cogmap.bus.access.subjects import Subject
from cogmap.schemas.topics import Topic

EVERY_AGENT = "*"
INGRESS = "ingress"
EGRESS = "egress"
READY = f"cogmap/{EVERY_AGENT}/@ready"
INCARNATIONS = f"cogmap/{EVERY_AGENT}/@incarnation"
SESSIONS = f"cogmap/{EVERY_AGENT}/@session"
USES = f"cogmap/{EVERY_AGENT}/@use"
CACHE = "@adv/pub/**"
"""Where, below a topic's key, Zenoh's cache of a publisher answers."""

PAST = "@past/**"
"""Where a publisher answers for what it has kept longer."""

EARLIER = ("@adv/**", PAST)
"""Where a subscriber asks for what it missed."""

_SEEING = ["liveliness_query", "declare_liveliness_subscriber"]


def access_control(subjects: Iterable[Subject]) -> dict[str, Any]:
    """Return the section `access_control` of a configuration of a router for `subjects`."""
    rules: list[dict[str, Any]] = []
    known = []
    policies = []
    for subject in subjects:
        own = rules_of(subject)
        rules += own
        known.append({"id": subject.name, "cert_common_names": [subject.name]})
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [subject.name]})

    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": known,
        "policies": policies,
    }


def rules_of(subject: Subject) -> list[dict[str, Any]]:
    """Return the rules of one subject."""
    published = _keys(subject.publishes)
    kept = _below(published, CACHE, PAST)
    subscribed = _keys(subject.subscribes)
    missed = _below(subscribed, *EARLIER)
    answered = _keys(subject.answers)
    asked = _keys(subject.asks)
    seen = [f"{READY}/**", f"{INCARNATIONS}/**"]
    if subject.discovers:
        seen += [f"{SESSIONS}/**", f"{USES}/**"]

    allowed = (
        ("publish", INGRESS, ["put"], published),
        ("publish-to", EGRESS, ["declare_subscriber"], [*published, *kept]),
        ("keep", INGRESS, ["put", "declare_queryable", "liveliness_token"], kept),
        ("keep-for", EGRESS, ["query"], _below(published, *EARLIER)),
        ("give", INGRESS, ["reply"], [*published, *kept, *answered]),
        ("subscribe", INGRESS, ["declare_subscriber"], [*subscribed, *missed]),
        ("receive", EGRESS, ["put"], [*subscribed, *missed]),
        ("ask", INGRESS, ["query"], [*asked, *missed]),
        ("ask-whom", EGRESS, ["declare_queryable"], [*asked, *missed]),
        ("get", EGRESS, ["reply"], [*asked, *subscribed, *missed]),
        ("answer", INGRESS, ["declare_queryable"], answered),
        ("answer-to", EGRESS, ["query"], answered),
        ("announce", INGRESS, ["liveliness_token"], tokens_of(subject)),
        ("see", INGRESS, _SEEING, [*seen, *missed]),
        ("seen", EGRESS, ["liveliness_token"], [*seen, *missed]),
    )
    return [
        {
            "id": f"{subject.name}-{name}",
            "permission": "allow",
            "flows": [flow],
            "messages": messages,
            "key_exprs": keys,
        }
        for name, flow, messages, keys in allowed
        if keys
    ]


def tokens_of(subject: Subject) -> list[str]:
    """Return the liveliness tokens that it may hold: who it is, since when, that it is ready, and
    what it does.
    """
    found = []
    for member in subject.members:
        found += [f"{root}/{member}/**" for root in (READY, INCARNATIONS, f"{SESSIONS}/*")]

    found += [f"{USES}/*/publisher/{topic.name}" for topic in _sorted(subject.publishes)]
    found += [f"{USES}/*/subscriber/{topic.name}" for topic in _sorted(subject.subscribes)]
    found += [f"{USES}/*/queryable/{topic.name}" for topic in _sorted(subject.answers)]
    return found


def _keys(topics: Iterable[Topic]) -> list[str]:
    return [topic.key(EVERY_AGENT) for topic in _sorted(topics)]


def _below(keys: Iterable[str], *suffixes: str) -> list[str]:
    return [f"{key}/{suffix}" for key in keys for suffix in suffixes]


def _sorted(topics: Iterable[Topic]) -> list[Topic]:
    return sorted(topics, key=lambda topic: topic.name)
