"""Changes of bytes: some know nothing of what they change, some know MessagePack."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import msgspec

Mutation = Callable[[bytearray, random.Random], None]
WILD: tuple[Any, ...] = (
    *(math.nan, math.inf, -math.inf, 1e308, -0.0, 5e-324),
    *(2**63, 2**64 - 1, -(2**63), 2**31, -1, 0),
    *(None, True, "", "x" * 300, "\0", b"", b"\0" * 64, [], {}, [[]] * 9, [0.5] * 999),
)
INTERESTING = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 2**31 - 1, 2**32 - 1, 2**63 - 1, 2**64 - 1)
LARGEST_HEADERS = (b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xc6\xff\xff\xff\xff")
NESTED = (b"\x91" * 20_000, b"[" * 20_000, b"{" * 9_000, b"\x81\xa1a" * 9_000)
MAX_CUT_BYTES = 64


def flip(data: bytearray, rng: random.Random) -> None:
    """Flip one bit."""
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def overwrite(data: bytearray, rng: random.Random) -> None:
    """Write a number at a limit of its type over bytes, in either order."""
    size = rng.choice((1, 2, 4, 8))
    number = rng.choice(INTERESTING) % (1 << (8 * size))
    start = rng.randrange(len(data))
    data[start : start + size] = number.to_bytes(size, rng.choice(("little", "big")))


def poison(data: bytearray, rng: random.Random) -> None:
    """Write NaN or infinity over bytes."""
    written = struct.pack(rng.choice(("<d", ">d", "<f", ">f")), rng.choice(WILD[:3]))
    start = rng.randrange(len(data))
    data[start : start + len(written)] = written


def cut(data: bytearray, rng: random.Random) -> None:
    """Remove some bytes."""
    start = rng.randrange(len(data))
    del data[start : start + rng.randint(1, MAX_CUT_BYTES)]


def truncate(data: bytearray, rng: random.Random) -> None:
    """Remove the end."""
    del data[rng.randrange(len(data)) :]


def repeat(data: bytearray, rng: random.Random) -> None:
    """Put a part of it there again, up to a hundred times."""
    start = rng.randrange(len(data))
    part = bytes(data[start : start + rng.randint(1, MAX_CUT_BYTES)])
    place = rng.randrange(len(data) + 1)
    data[place:place] = part * rng.choice((1, 2, 100))


def grow(data: bytearray, rng: random.Random) -> None:
    """Put random bytes, the head of something huge, or deep nesting between."""
    place = rng.randrange(len(data) + 1)
    kinds = (rng.randbytes(rng.randint(1, 16)), rng.choice(LARGEST_HEADERS), rng.choice(NESTED))
    data[place:place] = rng.choices(kinds, (8, 2, 1))[0]


def digits(data: bytearray, rng: random.Random) -> None:
    """Write a number of a text as another, of thousands of digits among others."""
    others = (b"9" * 5000, b"-1", b"1e999", b"nan", b"0", b"2147483648", b"99999999999999999999")
    places = [place for place, byte in enumerate(data[:4096]) if 0x30 <= byte <= 0x39]
    if places:
        place = rng.choice(places)
        data[place : place + 1] = rng.choice(others)


OF_BYTES: tuple[Mutation, ...] = (flip, overwrite, poison, cut, truncate, repeat, grow, digits)


def changed(content: bytes, rng: random.Random, other: bytes = b"") -> bytes:
    """Return content that was changed one to four times; sometimes with the end of `other`."""
    data = bytearray(content)
    if other and rng.random() < 0.1:
        data[rng.randrange(len(data) + 1) :] = other[rng.randrange(len(other) + 1) :]
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        if data:
            rng.choice(OF_BYTES)(data, rng)
    return bytes(data)


def rewritten(plain: Any, rng: random.Random, changes: int = 1) -> Any:
    """Return a decoded message, of which some values are others: of another type, length or depth,
    or at the limits of their type.
    """
    copied = msgspec.msgpack.decode(msgspec.msgpack.encode(plain))
    for _ in range(changes):
        places = list(_places(copied))
        if not places:
            break
        holder, key = rng.choice(places)
        holder[key] = _other(holder[key], rng)
    return copied


def _other(value: Any, rng: random.Random) -> Any:
    """Return a value that may stand in the place of another."""
    kind = rng.randrange(6)
    if kind == 0 and isinstance(value, int | float) and not isinstance(value, bool):
        number = rng.choice((-value, value * 2, value + 1, value * 1000, value / 3))
        return number if abs(number) < 2**63 else 2**63
    if kind == 1 and isinstance(value, list):
        return value * rng.choice((0, 2, 50)) if len(value) < 200 else []
    if kind == 2 and isinstance(value, dict):
        return {key: item for key, item in value.items() if rng.random() < 0.5}
    if kind == 3:
        return nested(value, rng.choice((1, 3, 60)))
    return deepcopy(rng.choice(WILD))


def nested(value: Any, depth: int) -> Any:
    """Return lists in lists, `value` in the innermost."""
    for _ in range(depth):
        value = [value]
    return value


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Return each place of a value within another, as its holder and its key."""
    found: list[tuple[Any, Any]] = []
    layer = [value]
    while layer:
        holder = layer.pop()
        keys = list(holder) if isinstance(holder, dict) else range(len(holder))
        for key in keys:
            found.append((holder, key))
            if isinstance(holder[key], dict | list):
                layer.append(holder[key])
    return found
