"""What is expected of a view before it is seen, by what was conscious. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from cogmap.geometry.arrays import Floats
from schemas.nodes import object_id


@dataclass(frozen=True)
class Prior:
    """A mixture of all labels alike and of those that are primed.

    `primed` has the activation that has spread to PAM nodes. The more it is in all, the larger is
    its share of the prior, up to `share`.
    """

    primed: Mapping[str, float] = field(default_factory=dict)
    share: float = 0.0

    def log_ratio(self, labels: Iterable[str]) -> Floats:
        """How much likelier each label is than if all were alike, as a logarithm, (n,)."""
        spread = np.array([self.primed.get(object_id(label), 0.0) for label in labels])
        total = float(spread.sum())
        if total <= 0.0:
            return np.zeros(len(spread))

        share = self.share * min(1.0, total)
        ratio = (1 - share) + share * len(spread) * spread / total
        return np.asarray(np.log(np.maximum(ratio, np.finfo(float).tiny)))


NOTHING_EXPECTED = Prior()
