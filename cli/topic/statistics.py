"""Rate, bandwidth and delay over the last messages of a topic."""

from __future__ import annotations

import statistics
from collections import deque
from collections.abc import Iterable

import msgspec
import numpy as np

from cogmap.bus.codec import Stage

MIN_SPAN_S = 1e-9


class Spread(msgspec.Struct, frozen=True):
    """Mean, minimum, maximum and standard deviation of `window` values."""

    mean: float
    least: float
    greatest: float
    deviation: float
    window: int

    @classmethod
    def of(cls, values: Iterable[float]) -> Spread:
        """The spread of `values`, at least one."""
        array = np.fromiter(values, np.float64)
        return cls(
            mean=float(array.mean()),
            least=float(array.min()),
            greatest=float(array.max()),
            deviation=float(array.std()),
            window=len(array),
        )


class Rate:
    """The rate over the last `window` messages."""

    def __init__(self, window: int) -> None:
        self._times_ns: deque[int] = deque(maxlen=window + 1)

    def add(self, at_ns: int) -> None:
        """Count a message that arrived at `at_ns`."""
        self._times_ns.append(at_ns)

    def periods_s(self) -> Spread | None:
        """The times between messages; None before the second. The rate is one over their mean."""
        times_ns = np.fromiter(self._times_ns, np.int64)
        periods_s = np.diff(times_ns) / 1e9
        return Spread.of(periods_s) if len(periods_s) else None


class Bandwidth:
    """Bytes per second over the last `window` messages."""

    def __init__(self, window: int) -> None:
        self._arrivals: deque[tuple[int, int]] = deque(maxlen=window)

    def add(self, at_ns: int, size_bytes: int) -> None:
        """Count a message that arrived at `at_ns`."""
        self._arrivals.append((at_ns, size_bytes))

    def bytes_per_s(self, now_ns: int) -> float:
        """The bytes in the window over the time since its first message."""
        if not self._arrivals:
            return 0.0

        total_bytes = sum(size for _, size in self._arrivals)
        first_ns, _ = self._arrivals[0]
        span_s = (now_ns - first_ns) / 1e9
        return total_bytes / max(MIN_SPAN_S, span_s)

    def sizes_bytes(self) -> Spread | None:
        """The sizes of messages. None before the first one."""
        if not self._arrivals:
            return None
        return Spread.of(size for _, size in self._arrivals)


class Delay:
    """Ages of the last `window` messages on arrival, and where the time went."""

    def __init__(self, window: int) -> None:
        self._ages_s: deque[float] = deque(maxlen=window)
        self._last_leg_s: deque[float] = deque(maxlen=window)
        self._stages: deque[list[Stage]] = deque(maxlen=window)

    def add(self, born_ns: int, sent_ns: int, received_ns: int, stages: list[Stage]) -> None:
        """Count a message that derives from the sensing at `born_ns`."""
        self._ages_s.append((received_ns - born_ns) / 1e9)
        self._last_leg_s.append((received_ns - sent_ns) / 1e9)
        self._stages.append(stages)

    def ages_s(self) -> Spread | None:
        """From the sensing to here. None before the first message."""
        return Spread.of(self._ages_s) if self._ages_s else None

    def last_leg_s(self) -> Spread | None:
        """From the last publisher to here. None before the first message."""
        return Spread.of(self._last_leg_s) if self._last_leg_s else None

    def stages_s(self) -> dict[str, tuple[float, float]]:
        """For each module passed, mean times of computing and of encoding, transport and queues."""
        computing_ns: dict[str, list[int]] = {}
        resting_ns: dict[str, list[int]] = {}
        for stages in self._stages:
            for module, compute_ns, rest_ns in stages:
                computing_ns.setdefault(module, []).append(compute_ns)
                resting_ns.setdefault(module, []).append(rest_ns)

        means = {}
        for module, computed_ns in computing_ns.items():
            compute_s = statistics.fmean(computed_ns) / 1e9
            rest_s = statistics.fmean(resting_ns[module]) / 1e9
            means[module] = (compute_s, rest_s)
        return means
