"""How often, how much and how late: figures over the last messages of a topic."""

from __future__ import annotations

import statistics
from collections import deque
from collections.abc import Iterable

import msgspec
import numpy as np

from cogmap.bus.codec import Stage


class Spread(msgspec.Struct, frozen=True):
    """Mean, least, greatest and standard deviation of `window` values."""

    mean: float
    least: float
    greatest: float
    deviation: float
    window: int

    @classmethod
    def of(cls, values: Iterable[float]) -> Spread:
        """The spread of values, at least one."""
        array = np.fromiter(values, np.float64)
        return cls(
            float(array.mean()),
            float(array.min()),
            float(array.max()),
            float(array.std()),
            len(array),
        )


class Rate:
    """The rate over the last `window` messages."""

    def __init__(self, window: int) -> None:
        self._times_ns: deque[int] = deque(maxlen=window + 1)

    def add(self, at_ns: int) -> None:
        """Take note of a message that came then."""
        self._times_ns.append(at_ns)

    def periods_s(self) -> Spread | None:
        """The times between messages; the rate is one over their mean. None before the second
        message.
        """
        periods = np.diff(np.fromiter(self._times_ns, np.int64)) / 1e9
        return Spread.of(periods) if len(periods) else None


class Bandwidth:
    """Bytes per second over the last `window` messages."""

    def __init__(self, window: int) -> None:
        self._seen: deque[tuple[int, int]] = deque(maxlen=window)

    def add(self, at_ns: int, size_bytes: int) -> None:
        """Take note of a message that came then."""
        self._seen.append((at_ns, size_bytes))

    def bytes_per_s(self, now_ns: int) -> float:
        """What has come, over the time since the first of it."""
        if not self._seen:
            return 0.0
        return sum(size for _, size in self._seen) / max(1e-9, (now_ns - self._seen[0][0]) / 1e9)

    def sizes_bytes(self) -> Spread | None:
        """The sizes of messages. None before the first one."""
        return Spread.of(size for _, size in self._seen) if self._seen else None


class Delay:
    """Ages of the last `window` messages as they came, and where the time went."""

    def __init__(self, window: int) -> None:
        self._ages_s: deque[float] = deque(maxlen=window)
        self._last_leg_s: deque[float] = deque(maxlen=window)
        self._stages: deque[list[Stage]] = deque(maxlen=window)

    def add(self, born_ns: int, sent_ns: int, received_ns: int, stages: list[Stage]) -> None:
        """Take note of a message that derives from the sensing at `born_ns`, sent and received
        then.
        """
        self._ages_s.append((received_ns - born_ns) / 1e9)
        self._last_leg_s.append((received_ns - sent_ns) / 1e9)
        self._stages.append(stages)

    def ages_s(self) -> Spread | None:
        """From the sensing to here. None before the first message."""
        return Spread.of(self._ages_s) if self._ages_s else None

    def last_leg_s(self) -> Spread | None:
        """From the sending to here. None before the first message."""
        return Spread.of(self._last_leg_s) if self._last_leg_s else None

    def stages_s(self) -> dict[str, tuple[float, float]]:
        """For each module on the way, mean times of computing and of all else (encoding, transport,
        queues).
        """
        times: dict[str, list[tuple[int, int]]] = {}
        for stages in self._stages:
            for module, compute_ns, rest_ns in stages:
                times.setdefault(module, []).append((compute_ns, rest_ns))
        return {
            module: (
                statistics.fmean(c for c, _ in spent) / 1e9,
                statistics.fmean(r for _, r in spent) / 1e9,
            )
            for module, spent in times.items()
        }
