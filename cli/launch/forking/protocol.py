"""What a supervisor and a fork server exchange: packets over a pair of sockets."""

from __future__ import annotations

import msgspec

MAX_BYTES = 65_536


class Request(msgspec.Struct, array_like=True):
    """Run `cogmap` with `arguments` in a new process, named `number`.

    Two file descriptors travel with it: what it reads from, and what it prints to.
    """

    number: int
    arguments: list[str]


class Report(msgspec.Struct, array_like=True):
    """Process `number` runs as `pid`; once it has ended, its exit code, or the number of the signal
    that ended it below 0.
    """

    number: int
    pid: int
    code: int | None = None


request_decoder = msgspec.msgpack.Decoder(Request)
report_decoder = msgspec.msgpack.Decoder(Report)
