"""Thresholds that a metric must meet, declared once, beside the benchmark that measures it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Threshold:
    """The values of a metric that meet its requirement, from `minimum` to `maximum`."""

    minimum: float = -math.inf
    maximum: float = math.inf
    exclusive: bool = False

    def is_met(self, value: float) -> bool:
        """Decide whether `value` lies within the limits, or between them if they are exclusive."""
        if self.exclusive:
            return self.minimum < value < self.maximum

        return self.minimum <= value <= self.maximum

    def __str__(self) -> str:
        if math.isinf(self.minimum):
            below = "<" if self.exclusive else "≤"
            return f"{below} {self.maximum:g}"

        if math.isinf(self.maximum):
            above = ">" if self.exclusive else "≥"
            return f"{above} {self.minimum:g}"

        return f"{self.minimum:g}-{self.maximum:g}"


Thresholds = dict[str, Threshold]


def at_most(limit: float) -> Threshold:
    """Make a threshold that is met by `limit` and less."""
    return Threshold(maximum=limit)


def less_than(limit: float) -> Threshold:
    """Make a threshold that is met by less than `limit`."""
    return Threshold(maximum=limit, exclusive=True)


def at_least(limit: float) -> Threshold:
    """Make a threshold that is met by `limit` and more."""
    return Threshold(minimum=limit)


def more_than(limit: float) -> Threshold:
    """Make a threshold that is met by more than `limit`."""
    return Threshold(minimum=limit, exclusive=True)


def within(minimum: float, maximum: float) -> Threshold:
    """Make a threshold that is met by both limits and what lies between."""
    return Threshold(minimum, maximum)
