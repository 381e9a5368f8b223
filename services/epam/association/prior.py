"""What is expected of a view before it is seen, by what was conscious. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from cogmap.geometry.arrays import Floats
from schemas.nodes import object_id


@dataclass(frozen=True)
class Prior:
    """All labels alike, and beside them those that are primed.

    `primed` has the activation that has spread to PAM nodes. Where it is 1 in all, or more, those
    have a mass of `share`, beside 1 of all labels together. Where the town is familiar, an unknown
    building is so much less likely.
    """

    primed: Mapping[str, float] = field(default_factory=dict)
    share: float = 0.0

    def log_ratio(self, labels: Iterable[str]) -> Floats:
        """How much likelier each label is than if none were primed, as a logarithm, (n,)."""
        spread = np.array([self.primed.get(object_id(label), 0.0) for label in labels])
        expected = spread / max(1.0, float(spread.sum()))
        return np.log1p(self.share * len(spread) * expected)


NOTHING_EXPECTED = Prior()
