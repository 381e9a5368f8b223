"""Rate, bandwidth and delay over the last messages of a topic."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable
from statistics import fmean
from typing import Any

import msgspec
import numpy as np

from cogmap.bus.codec import Stage
from cogmap.cli.topic.observing import Reception

MIN_SPAN_S = 1e-9
"""Two messages may be received in the same nanosecond."""


class Spread(msgspec.Struct, frozen=True):
    """Mean, minimum, maximum and standard deviation of `window` values."""

    mean: float
    least: float
    greatest: float
    deviation: float
    window: int

    @classmethod
    def of(cls, values: Iterable[float]) -> Spread | None:
        """Return the spread of `values`, or None if there are none."""
        array = np.fromiter(values, np.float64)
        if not array.size:
            return None
        return cls(
            mean=float(array.mean()),
            least=float(array.min()),
            greatest=float(array.max()),
            deviation=float(array.std()),
            window=len(array),
        )


class Statistics(ABC):
    """What one of the commands computes from the last `window` receptions."""

    min_messages = 1

    @abstractmethod
    def add(self, reception: Reception) -> None:
        """Count one message."""

    @abstractmethod
    def text(self) -> str:
        """Write the statistics so far, as people read them; empty before `min_messages`."""

    @abstractmethod
    def plain(self) -> dict[str, Any]:
        """Return the statistics so far, as programs read them."""


class Rate(Statistics):
    """How often messages arrive."""

    min_messages = 2

    def __init__(self, window: int) -> None:
        self._times_ns: deque[int] = deque(maxlen=window + 1)

    def add(self, reception: Reception) -> None:
        self._times_ns.append(reception.received_ns)

    def periods_s(self) -> Spread | None:
        """Measure periods of messages; None before the second. The rate is one over their mean."""
        return Spread.of(np.diff(np.fromiter(self._times_ns, np.int64)) / 1e9)

    def text(self) -> str:
        period = self.periods_s()
        if period is None:
            return ""
        return (
            f"average rate: {1 / max(MIN_SPAN_S, period.mean):.3f}\n"
            f"\tmin: {period.least:.3f}s max: {period.greatest:.3f}s "
            f"std dev: {period.deviation:.5f}s window: {period.window + 1}"
        )

    def plain(self) -> dict[str, Any]:
        period = self.periods_s()
        rate_hz = 1 / max(MIN_SPAN_S, period.mean) if period else None
        return {"rate_hz": rate_hz, "period_s": msgspec.to_builtins(period)}


class Bandwidth(Statistics):
    """How many bytes arrive in a second."""

    min_messages = 2

    def __init__(self, window: int) -> None:
        self._arrivals: deque[tuple[int, int]] = deque(maxlen=window)

    def add(self, reception: Reception) -> None:
        self._arrivals.append((reception.received_ns, reception.size_bytes))

    def bytes_per_s(self) -> float | None:
        """Divide the bytes after the first message of the window by the time from it to the last;
        None before the second.
        """
        if len(self._arrivals) < self.min_messages:
            return None

        (first_ns, _), *later = self._arrivals
        last_ns, _ = later[-1]
        span_s = (last_ns - first_ns) / 1e9
        return sum(size for _, size in later) / max(MIN_SPAN_S, span_s)

    def sizes_bytes(self) -> Spread | None:
        """Return the spread of the sizes of messages. None before the first one."""
        return Spread.of(size for _, size in self._arrivals)

    def text(self) -> str:
        sizes = self.sizes_bytes()
        bytes_per_s = self.bytes_per_s()
        if sizes is None or bytes_per_s is None:
            return ""

        mean, least, greatest = map(in_bytes, (sizes.mean, sizes.least, sizes.greatest))
        return (
            f"{in_bytes(bytes_per_s)}/s from {sizes.window} messages\n"
            f"\tMessage size mean: {mean} min: {least} max: {greatest}"
        )

    def plain(self) -> dict[str, Any]:
        sizes = msgspec.to_builtins(self.sizes_bytes())
        return {"bytes_per_s": self.bytes_per_s(), "size_bytes": sizes}


class Delay(Statistics):
    """How old messages are when they arrive, and where the time went."""

    def __init__(self, window: int) -> None:
        self._ages_s: deque[float] = deque(maxlen=window)
        self._last_leg_s: deque[float] = deque(maxlen=window)
        self._stages: deque[list[Stage]] = deque(maxlen=window)

    def add(self, reception: Reception) -> None:
        envelope = reception.envelope
        if envelope is not None:
            self._ages_s.append((reception.received_ns - envelope.born_ns) / 1e9)
            self._last_leg_s.append((reception.received_ns - envelope.sent_ns) / 1e9)
            self._stages.append(envelope.stages)

    def ages_s(self) -> Spread | None:
        """Return the spread of times from the sensing to here. None before the first message."""
        return Spread.of(self._ages_s)

    def last_leg_s(self) -> Spread | None:
        """Return the spread of the times from the last publisher to here. None before the first."""
        return Spread.of(self._last_leg_s)

    def stages_s(self) -> dict[str, tuple[float, float]]:
        """Average each passed module's times of computing and of encoding, transport and queues."""
        times_s: dict[str, list[tuple[float, float]]] = {}
        for stages in self._stages:
            for module, compute_ns, rest_ns in stages:
                times_s.setdefault(module, []).append((compute_ns / 1e9, rest_ns / 1e9))

        means = {}
        for module, of_module in times_s.items():
            compute_s, rest_s = zip(*of_module, strict=True)
            means[module] = (fmean(compute_s), fmean(rest_s))
        return means

    def text(self) -> str:
        age = self.ages_s()
        last_leg = self.last_leg_s()
        if age is None or last_leg is None:
            return ""

        lines = [
            f"average delay: {age.mean:.5f}",
            f"\tmin: {age.least:.5f}s max: {age.greatest:.5f}s "
            f"std dev: {age.deviation:.5f}s window: {age.window}",
        ]
        for module, (compute_s, rest_s) in self.stages_s().items():
            lines.append(f"\t{module}: {compute_s:.5f}s computing, {rest_s:.5f}s in transport")
        lines.append(f"\tfrom its last publisher: {last_leg.mean:.5f}s")
        return "\n".join(lines)

    def plain(self) -> dict[str, Any]:
        stages = {
            module: {"compute_s": compute_s, "rest_s": rest_s}
            for module, (compute_s, rest_s) in self.stages_s().items()
        }
        return {
            "delay_s": msgspec.to_builtins(self.ages_s()),
            "last_leg_s": msgspec.to_builtins(self.last_leg_s()),
            "stages": stages,
        }


def in_bytes(size: float) -> str:
    """Format `size` bytes with the unit that leaves at most three digits before the point."""
    if abs(size) < 1000:
        return f"{size:.0f} B"

    for unit in ("KB", "MB"):
        size /= 1000
        if abs(size) < 1000:
            return f"{size:.2f} {unit}"
    return f"{size / 1000:.2f} GB"
