"""How many may come at once, and how many on average. Pure."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Budget:
    """What may come: `burst` at once, and `rate_hz` on average. `left` may come as of `at_s`."""

    burst: float
    rate_hz: float
    at_s: float
    left: float

    @classmethod
    def full(cls, burst: float, rate_hz: float, now_s: float) -> Budget:
        """Make one of which nothing has been spent."""
        return cls(burst, rate_hz, now_s, burst)

    def refill(self, now_s: float) -> None:
        """Add what the time since the last call allows."""
        passed_s = now_s - self.at_s
        self.at_s = now_s
        self.left = min(self.burst, self.left + passed_s * self.rate_hz)

    def spend(self, count: float, most_owed: float) -> None:
        """Take `count` from it. It may go below zero, by at most `most_owed`."""
        self.left = max(self.left - count, -most_owed)
