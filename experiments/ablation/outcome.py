"""What one run gave: how much the agent errs, beside path integration alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cogmap.experiments.ablation.variants import Rules

LOST_OVER_FUSED = 2.0


@dataclass(frozen=True)
class Outcome:
    """Errors of the agent, of fused self-motion alone and of the wheels alone, in the unit of their
    domain, or what else that measures of the agent; NaN where there is none. `failure` says why a
    run ended early, empty if it did not.
    """

    error: float
    fused: float
    wheels: float
    is_lost: bool
    failure: str = ""

    @property
    def over_fused(self) -> float:
        """Return the agent's error over that of fused self-motion alone."""
        return self.error / self.fused if self.fused > 0 else float("nan")


class Case(Protocol):
    """A drive that is the same for all rules: the same place, and the same seed of its noise."""

    def drive(self, rules: Rules) -> Outcome:
        """Drive it with these rules. Raises CogmapError if it cannot be driven to its end."""


def carried(error_m: float, fused_m: float, wheels_m: float) -> Outcome:
    """Return the outcome of a run whose robot is carried along a line: it is lost if it errs
    LOST_OVER_FUSED times as much as fused self-motion alone.
    """
    is_lost = not error_m <= LOST_OVER_FUSED * fused_m
    return Outcome(error_m, fused_m, wheels_m, is_lost)


def failed(reason: str) -> Outcome:
    """Return the outcome of a run that gave nothing: it is lost."""
    return Outcome(np.nan, np.nan, np.nan, is_lost=True, failure=reason)
