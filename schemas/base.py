"""What every message and every part of one has in common."""

from __future__ import annotations

import math
import sys
from typing import Annotated

import msgspec

Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
# msgpack carries NaN and infinity; a bounded type refuses both, at no cost.
Finite = Annotated[float, msgspec.Meta(ge=-sys.float_info.max, le=sys.float_info.max)]
Scalar = Finite | int | str | bool
Unit = Annotated[float, msgspec.Meta(ge=0, le=1)]
Metres = Annotated[float, msgspec.Meta(ge=0, le=1e6)]
Coordinate = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]

# Quantities of settings, bounded against infinite and absurd values. A key adds its description:
# Annotated[Share, msgspec.Meta(description="...")].
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
PositiveShare = Annotated[float, msgspec.Meta(gt=0, le=1)]
PositiveMetres = Annotated[float, msgspec.Meta(gt=0, le=1e4)]
PositiveSeconds = Annotated[float, msgspec.Meta(gt=0, le=3600)]
PositiveRadians = Annotated[float, msgspec.Meta(gt=0, le=math.tau)]
PositiveSpeed = Annotated[float, msgspec.Meta(gt=0, le=100)]
PositiveAcceleration = Annotated[float, msgspec.Meta(gt=0, le=100)]


class Part(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """A piece of a message. Every float in it is Finite or bounded more closely.

    Parts are frozen, so they may be shared, and form trees, never cycles, so the garbage collector
    ignores them.
    """


class Message(Part, kw_only=True, frozen=True, gc=False):
    """What travels on a topic.

    `stamp_ns` is the time of the sensing that it derives from; `seq` counts the messages of one
    `source` on one topic from 0. The module that publishes it fills in `seq` and `source`.
    """

    stamp_ns: Count = 0
    seq: Count = 0
    source: str = ""
