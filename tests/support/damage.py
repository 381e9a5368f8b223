"""Ways in which bytes that claim to be a message are none."""

from __future__ import annotations

import math
import random
from typing import Any

import msgspec
import numpy as np

from cogmap.schemas import topics
from cogmap.schemas.examples import GOLDEN
from cogmap.schemas.topics import Topic


def golden(topic: Topic) -> bytes:
    return (GOLDEN / f"{topic.file_stem}.msgpack").read_bytes()


def poisoned(value: Any, poison: float) -> Any:
    """`value` with `poison` in place of its first float, in an array or not; unchanged where it has
    none.
    """
    return _poison(value, poison, [False])


def _poison(value: Any, poison: float, done: list[bool]) -> Any:
    if done[0]:
        return value
    if isinstance(value, float):
        done[0] = True
        return poison
    if isinstance(value, list):
        return [_poison(item, poison, done) for item in value]
    if not isinstance(value, dict):
        return value

    if not str(value.get("dtype")).startswith("<f"):
        return {key: _poison(item, poison, done) for key, item in value.items()}
    done[0] = True
    numbers = np.frombuffer(value["data"], value["dtype"]).copy()
    numbers[-1] = poison
    return {**value, "data": numbers.tobytes()}


def stretched(value: Any) -> Any:
    """`value` with every array claiming to be far larger than it is."""
    if isinstance(value, list):
        return [stretched(item) for item in value]
    if not isinstance(value, dict):
        return value

    changed = {key: stretched(item) for key, item in value.items()}
    if "shape" in changed:
        changed["shape"] = [2**62, 2**62]
    return changed


def damaged(topic: Topic) -> dict[str, bytes]:
    """Payloads that `topic` must not carry, by what is wrong with them."""
    whole = golden(topic)
    plain = msgspec.msgpack.decode(whole)
    encode = msgspec.msgpack.encode
    is_command = topic is topics.MOTOR_COMMAND
    of_another = encode([1, 2, 3]) if is_command else golden(topics.MOTOR_COMMAND)

    payloads = {
        "random": random.Random(topic.name).randbytes(200),
        "empty": b"",
        "truncated": whole[:-3],
        "wrong type": of_another,
        "a number": encode(7),
        "NaN": encode(poisoned(plain, math.nan)),
        "infinity": encode(poisoned(plain, -math.inf)),
        "stretched arrays": encode(stretched(plain)),
        "negative number": encode({**plain, "seq": -1}),
        "huge number": encode({**plain, "stamp_ns": 2**63}),
        "deep nesting": b"\x91" * 100_000,
        "huge": whole + bytes(topic.max_bytes),
    }
    return {what: payload for what, payload in payloads.items() if payload != whole}
