"""Noise of the senses, fitted by coordinate descent (paper §6.1)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import msgspec

Noise = TypeVar("Noise", bound=msgspec.Struct)
SELF_MOTION = ("speed", "turn")
# Many pairs fit as well as one another; small steps from the same start keep either from running
# ahead.
FACTORS = (1.2, 1.1)


def coordinate_descent(
    cost: Callable[[Noise], float],
    noise: Noise,
    factors: Sequence[float] = FACTORS,
    names: Sequence[str] = SELF_MOTION,
) -> Noise:
    """Return the noise that no step up or down in one of `names` alone betters, steps growing finer
    by `factors`.

    `cost` must be the same for the same noise.
    """
    lowest = cost(noise)

    for factor in factors:
        improved = True
        while improved:
            improved = False
            for name in names:
                for step in (factor, 1 / factor):
                    changed = {name: getattr(noise, name) * step}
                    tried = msgspec.structs.replace(noise, **changed)
                    found = cost(tried)
                    if found < lowest:
                        noise = tried
                        lowest = found
                        improved = True
                        break

    return noise
