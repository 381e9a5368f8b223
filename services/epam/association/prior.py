"""What is expected of a view by what was conscious, and by what else is seen in it. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import object_id


@dataclass(frozen=True)
class Prior:
    """All labels alike, and beside them those that are primed.

    `primed` has the activation that has spread to PAM nodes. Where it is 1 in all, or more, those
    have a mass of `share`, beside 1 of all labels together. Where the town is familiar, an unknown
    building is so much less likely. `related` has the PAM nodes to which links lead from each
    relation, with their weights.
    """

    primed: Mapping[str, float] = field(default_factory=dict)
    share: float = 0.0
    related: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def where(self, relations: Mapping[str, float]) -> Prior:
        """The prior of what stands in `relations`, each with its activation: over the links from
        them it is primed too.
        """
        primed = dict(self.primed)
        for relation, activation in relations.items():
            for name, weight in self.related.get(relation, {}).items():
                primed[name] = max(primed.get(name, 0.0), activation * weight)

        return replace(self, primed=primed)

    def log_ratio(self, labels: Iterable[str]) -> Floats:
        """How much likelier each label is than if none were primed, as a logarithm, (n,)."""
        spread = np.array([self.primed.get(object_id(label), 0.0) for label in labels])
        expected = spread / max(1.0, float(spread.sum()))
        return np.log1p(self.share * len(spread) * expected)


NOTHING_EXPECTED = Prior()
