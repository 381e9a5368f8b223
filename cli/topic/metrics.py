"""What `cogmap topic hz`, `bw` and `delay` print of the messages they received."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from typing import Any

import msgspec

from cogmap.cli.topic.observing import Reception
from cogmap.cli.topic.statistics import Bandwidth, Delay, Rate

MIN_PERIOD_S = 1e-9


class Metrics(ABC):
    """What one of the commands computes from receptions."""

    @abstractmethod
    def add(self, reception: Reception) -> None:
        """Count one message."""

    @abstractmethod
    def text(self) -> str:
        """The metrics so far, as people read them; empty where there are none."""

    @abstractmethod
    def plain(self) -> dict[str, Any]:
        """The metrics so far, as programs read them."""


class RateMetrics(Metrics):
    """How often messages arrive."""

    def __init__(self, window: int) -> None:
        self._rate = Rate(window)

    def add(self, reception: Reception) -> None:
        self._rate.add(reception.received_ns)

    def text(self) -> str:
        period = self._rate.periods_s()
        if period is None:
            return ""

        rate_hz = 1 / max(MIN_PERIOD_S, period.mean)
        return (
            f"average rate: {rate_hz:.3f}\n"
            f"\tmin: {period.least:.3f}s max: {period.greatest:.3f}s "
            f"std dev: {period.deviation:.5f}s window: {period.window + 1}"
        )

    def plain(self) -> dict[str, Any]:
        period = self._rate.periods_s()
        rate_hz = 1 / max(MIN_PERIOD_S, period.mean) if period else None
        return {"rate_hz": rate_hz, "period_s": _plain(period)}


class BandwidthMetrics(Metrics):
    """How many bytes arrive in a second."""

    def __init__(self, window: int) -> None:
        self._bandwidth = Bandwidth(window)

    def add(self, reception: Reception) -> None:
        self._bandwidth.add(reception.received_ns, reception.size_bytes)

    def text(self) -> str:
        sizes = self._bandwidth.sizes_bytes()
        if sizes is None:
            return ""

        per_second = in_bytes(self._bandwidth.bytes_per_s(time.time_ns()))
        mean = in_bytes(sizes.mean)
        least = in_bytes(sizes.least)
        greatest = in_bytes(sizes.greatest)
        return (
            f"{per_second}/s from {sizes.window} messages\n"
            f"\tMessage size mean: {mean} min: {least} max: {greatest}"
        )

    def plain(self) -> dict[str, Any]:
        sizes = self._bandwidth.sizes_bytes()
        bytes_per_s = self._bandwidth.bytes_per_s(time.time_ns())
        return {"bytes_per_s": bytes_per_s, "size_bytes": _plain(sizes)}


class DelayMetrics(Metrics):
    """How old messages are when they arrive."""

    def __init__(self, window: int) -> None:
        self._delay = Delay(window)

    def add(self, reception: Reception) -> None:
        envelope = reception.envelope
        if envelope is not None:
            self._delay.add(
                envelope.born_ns, envelope.sent_ns, reception.received_ns, envelope.stages
            )

    def text(self) -> str:
        age = self._delay.ages_s()
        last_leg = self._delay.last_leg_s()
        if age is None or last_leg is None:
            return ""

        lines = [
            f"average delay: {age.mean:.5f}",
            f"\tmin: {age.least:.5f}s max: {age.greatest:.5f}s "
            f"std dev: {age.deviation:.5f}s window: {age.window}",
        ]
        for module, (compute_s, rest_s) in self._delay.stages_s().items():
            lines.append(f"\t{module}: {compute_s:.5f}s computing, {rest_s:.5f}s in transport")
        lines.append(f"\tfrom its last publisher: {last_leg.mean:.5f}s")
        return "\n".join(lines)

    def plain(self) -> dict[str, Any]:
        stages = {}
        for module, (compute_s, rest_s) in self._delay.stages_s().items():
            stages[module] = {"compute_s": compute_s, "rest_s": rest_s}

        return {
            "delay_s": _plain(self._delay.ages_s()),
            "last_leg_s": _plain(self._delay.last_leg_s()),
            "stages": stages,
        }


def _plain(spread: msgspec.Struct | None) -> Any:
    return None if spread is None else msgspec.to_builtins(spread)


def in_bytes(size: float) -> str:
    """`size` bytes with the unit that leaves at most three digits before the point."""
    if abs(size) < 1000:
        return f"{size:.0f} B"

    for unit in ("KB", "MB"):
        size /= 1000
        if abs(size) < 1000:
            return f"{size:.2f} {unit}"
    return f"{size / 1000:.2f} GB"
