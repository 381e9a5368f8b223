"""How many of the buildings of a drive are ones that perception was taught. Pure.

A posterior is right where as many buildings are taught ones as where it was calibrated. In a town
of strangers, one that looks like a taught building is more often another. So the likeliest share is
found from what was seen so far (Saerens, Latinne and Decaestecker 2002, "Adjusting the outputs of a
classifier to new a priori probabilities", who maximize the same likelihood by steps).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cogmap.errors import MessageError
from cogmap.schemas.array import Array
from cogmap.services.epam.recognition.objects import Recognition

LOG_RATIOS = np.linspace(-5.0, 0.0, 51)
"""Of the odds that a building is a taught one to those where posteriors were calibrated. Where most
are taught, a stranger is no less likely: that is up to what is expected of a view (`Prior`)."""

PRIOR_SIGHTINGS = 70.0
"""The calibrated share counts as much as so many sights of buildings: those of one building (5,600
of 76 buildings in three minutes of a town of blocks)."""

LATEST_SIGHTINGS = 4000.0
"""A sight counts less by 1 / e after so many others, those of two minutes there: the next district
may be another one."""


class TaughtShare:
    """The log likelihood of each of LOG_RATIOS, `log_likelihood` (n,), by what was seen lately;
    `calibrated` is the share where posteriors were calibrated.
    """

    def __init__(self, calibrated: float) -> None:
        odds = np.exp(LOG_RATIOS) * calibrated / (1 - calibrated)
        shares = odds / (1 + odds)
        self._taught = shares / calibrated
        self._strange = (1 - shares) / (1 - calibrated)

        of_taught = calibrated * np.log(shares)
        of_strange = (1 - calibrated) * np.log(1 - shares)
        self._log_prior = PRIOR_SIGHTINGS * (of_taught + of_strange)
        self.log_likelihood = np.zeros(len(LOG_RATIOS))

    @property
    def log_ratio(self) -> float:
        """Return the likeliest of LOG_RATIOS."""
        return float(LOG_RATIOS[np.argmax(self._log_prior + self.log_likelihood)])

    def add(self, recognitions: Iterable[Recognition]) -> None:
        """Count what a view shows, recognized as where it was calibrated."""
        for recognition in recognitions:
            building = 1 - recognition.background
            if building <= 0:
                continue

            strange = recognition.unknown / building
            likelihood = (1 - strange) * self._taught + strange * self._strange
            self.log_likelihood *= 1 - building / LATEST_SIGHTINGS
            self.log_likelihood += building * np.log(likelihood)

    def published(self) -> Array:
        """Return the log likelihoods as they are now."""
        return Array.of(self.log_likelihood)

    def restore(self, kept: Array) -> None:
        """Continue with what was published. Raises MessageError if it is of other ratios."""
        if kept.shape != self.log_likelihood.shape:
            raise MessageError(
                f"{kept.shape} likelihoods of the share of taught buildings: "
                f"there should be {self.log_likelihood.shape}"
            )
        self.log_likelihood = np.array(kept.numpy(), np.float64)
