"""The noise of self-motion, fitted by coordinate descent (paper §6.1)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import msgspec

Noise = TypeVar("Noise", bound=msgspec.Struct)
# Many pairs fit as well as one another; small steps from the same start keep either from running
# ahead.
FACTORS = (1.2, 1.1)


def coordinate_descent(
    cost: Callable[[Noise], float], noise: Noise, factors: tuple[float, ...] = FACTORS
) -> Noise:
    """The noise that no step up or down in speed or in turn alone betters, steps growing finer by
    `factors`.

    `cost` must be the same for the same noise.
    """
    lowest = cost(noise)

    for factor in factors:
        improved = True
        while improved:
            improved = False
            for name in ("speed", "turn"):
                for tried in _steps(noise, name, factor):
                    found = cost(tried)
                    if found < lowest:
                        noise = tried
                        lowest = found
                        improved = True
                        break

    return noise


def _steps(noise: Noise, name: str, factor: float) -> list[Noise]:
    """`noise` with one of its values a step up, and a step down."""
    value = getattr(noise, name)
    steps = []

    for step in (factor, 1 / factor):
        changed = {name: value * step}
        steps.append(msgspec.structs.replace(noise, **changed))

    return steps
