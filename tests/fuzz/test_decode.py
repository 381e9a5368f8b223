"""Bytes changed at random: decoding accepts them as a message or names what is wrong, and never
accepts a number that is not finite.
"""

from __future__ import annotations

import math
import random
from typing import Any

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import Envelope, decode, decode_envelope, encode
from cogmap.errors import MessageError
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.topics import Topic
from tests.support.damage import golden

ROUNDS = 1500
ODDS = 0.1
WILD = [
    math.nan,
    math.inf,
    -math.inf,
    1e308,
    -0.0,
    2**64 - 1,
    -(2**63),
    None,
    "",
    "x" * 300,
    b"",
    [],
    {},
    True,
]


def flip(data: bytearray, rng: random.Random) -> None:
    for _ in range(rng.randint(1, 4)):
        place = rng.randrange(len(data))
        data[place] = rng.randrange(256)


def cut(data: bytearray, rng: random.Random) -> None:
    start = rng.randrange(len(data))
    end = start + rng.randint(1, 16)
    del data[start:end]


def grow(data: bytearray, rng: random.Random) -> None:
    place = rng.randrange(len(data))
    data[place:place] = rng.randbytes(rng.randint(1, 16))


def poison(data: bytearray, rng: random.Random) -> None:
    """Put NaN or infinity over eight or four bytes, where a float may be."""
    number = rng.choice([math.nan, math.inf, -math.inf])
    dtype = rng.choice(["<f8", ">f8", "<f4", ">f4"])
    written = np.array([number], dtype).tobytes()

    start = rng.randrange(len(data))
    end = start + len(written)
    data[start:end] = written


MUTATIONS = (flip, cut, grow, poison)


def mutated(payload: bytes, rng: random.Random) -> bytes:
    data = bytearray(payload)
    for _ in range(rng.randint(1, 3)):
        if data:
            mutate = rng.choice(MUTATIONS)
            mutate(data, rng)
    return bytes(data)


def rewritten(value: Any, rng: random.Random, odds: float) -> Any:
    """`value` with some of its leaves and keys replaced by what nobody expects there."""
    if rng.random() < odds:
        return rng.choice(WILD)
    if isinstance(value, dict):
        kept = {key: item for key, item in value.items() if rng.random() > odds / 4}
        return {key: rewritten(item, rng, odds) for key, item in kept.items()}
    if isinstance(value, list):
        items = [rewritten(item, rng, odds) for item in value]
        return items + items if rng.random() < odds else items
    return value


def numbers(value: Any) -> list[float]:
    """Every float in a message, in its arrays too."""
    if isinstance(value, float):
        return [value]
    if isinstance(value, Array):
        return [float(number) for number in value.numpy().ravel()]
    if isinstance(value, msgspec.Struct):
        return numbers([getattr(value, name) for name in value.__struct_fields__])
    if isinstance(value, dict):
        return numbers(list(value.values()))
    if isinstance(value, list | tuple):
        return [number for item in value for number in numbers(item)]
    return []


def is_accepted(topic: Topic, payload: bytes) -> bool:
    """Whether `payload` is decoded to a message. One that is has finite numbers, and can be encoded
    again.
    """
    try:
        message = decode(topic, payload)
    except MessageError as error:
        assert str(error).startswith(topic.name)
        return False
    assert all(map(math.isfinite, numbers(message)))
    assert decode(topic, encode(message)) == message
    return True


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.name)
def test_mutated_bytes_are_refused_by_name_or_finite_messages(topic: Topic) -> None:
    rng = random.Random(topic.name)
    whole = golden(topic)

    accepted = [is_accepted(topic, mutated(whole, rng)) for _ in range(ROUNDS)]

    assert is_accepted(topic, whole)
    assert accepted.count(False) > ROUNDS / 4


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.name)
def test_wellformed_bytes_of_wrong_content_are_refused_or_finite_messages(topic: Topic) -> None:
    rng = random.Random(topic.name)
    plain = msgspec.msgpack.decode(golden(topic))

    accepted = []
    for _ in range(ROUNDS):
        payload = msgspec.msgpack.encode(rewritten(plain, rng, ODDS))
        accepted.append(is_accepted(topic, payload))

    assert False in accepted


@pytest.mark.parametrize("length", [0, 1, 2])
def test_no_byte_string_of_up_to_two_bytes_is_an_envelope(length: int) -> None:
    for number in range(256**length):
        payload = number.to_bytes(length, "big")
        with pytest.raises(MessageError):
            decode_envelope(payload)


def test_mutated_envelopes_are_refused_or_encode_to_the_same() -> None:
    rng = random.Random(7)
    stage = ("sensory", 10, 20)
    cause = ("odometry", "sim", 3)
    whole = encode(Envelope("sim", 7, 1, 2**60, 2**60, [stage], [cause]))

    accepted = 0
    for _ in range(ROUNDS * 3):
        try:
            envelope = decode_envelope(mutated(whole, rng))
        except MessageError:
            continue
        accepted += 1
        assert decode_envelope(encode(envelope)) == envelope

    assert 0 < accepted < ROUNDS * 3
