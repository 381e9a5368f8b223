"""What `cogmap topic hz`, `bw` and `delay` say of the messages they saw."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from typing import Any

import msgspec

from cli.topic.observing import Sight
from cli.topic.statistics import Bandwidth, Delay, Rate


class Figures(ABC):
    """What one of the commands makes of what it sees."""

    @abstractmethod
    def add(self, sight: Sight) -> None:
        """Take note of one message."""

    @abstractmethod
    def text(self) -> str:
        """The figures so far, as people read them; empty where there are none."""

    @abstractmethod
    def plain(self) -> dict[str, Any]:
        """The figures so far, as programs read them."""


class RateFigures(Figures):
    """How often messages come."""

    def __init__(self, window: int) -> None:
        self._rate = Rate(window)

    def add(self, sight: Sight) -> None:
        self._rate.add(sight.received_ns)

    def text(self) -> str:
        spread = self._rate.periods_s()
        if spread is None:
            return ""
        return (
            f"average rate: {1 / max(1e-9, spread.mean):.3f}\n\tmin: {spread.least:.3f}s max: {spread.greatest:.3f}s "
            f"std dev: {spread.deviation:.5f}s window: {spread.window + 1}"
        )

    def plain(self) -> dict[str, Any]:
        spread = self._rate.periods_s()
        return {
            "rate_hz": 1 / max(1e-9, spread.mean) if spread else None,
            "period_s": _plain(spread),
        }


class BandwidthFigures(Figures):
    """How many bytes come in a second."""

    def __init__(self, window: int) -> None:
        self._bandwidth = Bandwidth(window)

    def add(self, sight: Sight) -> None:
        self._bandwidth.add(sight.received_ns, sight.size_bytes)

    def text(self) -> str:
        sizes = self._bandwidth.sizes_bytes()
        if sizes is None:
            return ""
        mean, least, greatest = (
            in_bytes(value) for value in (sizes.mean, sizes.least, sizes.greatest)
        )
        per_second = in_bytes(self._bandwidth.bytes_per_s(time.time_ns()))
        return f"{per_second}/s from {sizes.window} messages\n\tMessage size mean: {mean} min: {least} max: {greatest}"

    def plain(self) -> dict[str, Any]:
        sizes = self._bandwidth.sizes_bytes()
        return {
            "bytes_per_s": self._bandwidth.bytes_per_s(time.time_ns()),
            "size_bytes": _plain(sizes),
        }


class DelayFigures(Figures):
    """How old messages are as they come."""

    def __init__(self, window: int) -> None:
        self._delay = Delay(window)

    def add(self, sight: Sight) -> None:
        if (envelope := sight.envelope) is not None:
            self._delay.add(envelope.born_ns, envelope.sent_ns, sight.received_ns, envelope.stages)

    def text(self) -> str:
        ages = self._delay.ages_s()
        last_leg = self._delay.last_leg_s()
        if ages is None or last_leg is None:
            return ""
        stages = [
            f"\n\t{module}: {compute:.5f}s computing, {rest:.5f}s getting there"
            for module, (compute, rest) in self._delay.stages_s().items()
        ]
        return (
            f"average delay: {ages.mean:.5f}\n\tmin: {ages.least:.5f}s max: {ages.greatest:.5f}s "
            f"std dev: {ages.deviation:.5f}s window: {ages.window}{''.join(stages)}"
            f"\n\tfrom its sending to here: {last_leg.mean:.5f}s"
        )

    def plain(self) -> dict[str, Any]:
        stages = {
            module: {"compute_s": c, "rest_s": r}
            for module, (c, r) in self._delay.stages_s().items()
        }
        ages = self._delay.ages_s()
        last_leg = self._delay.last_leg_s()
        return {"delay_s": _plain(ages), "last_leg_s": _plain(last_leg), "stages": stages}


def _plain(spread: msgspec.Struct | None) -> Any:
    return None if spread is None else msgspec.to_builtins(spread)


def in_bytes(size: float) -> str:
    """`size` bytes with a unit that leaves it three digits before the point at most."""
    for unit in ("B", "KB", "MB"):
        if abs(size) < 1000:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.2f} {unit}"
        size /= 1000
    return f"{size:.2f} GB"
