"""The prior of names in a view, by what was conscious and by what else is seen in it. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import name_id


@dataclass(frozen=True)
class Prior:
    """The sum of a uniform prior over all labels, of mass 1, and of one over those that are primed.

    `primed` has the activation that has spread to PAM nodes. If it sums to 1 or more, those have a
    mass of `share`, else of that part of it. So an unknown building is less likely in a familiar
    town. `related` has the PAM nodes to which links lead from each relation, with their weights.
    """

    primed: Mapping[str, float] = field(default_factory=dict)
    share: float = 0.0
    related: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def where(self, relations: Mapping[str, float]) -> Prior:
        """Return the prior of what stands in `relations`, each with its activation: it is also
        primed over the links from them.
        """
        primed = dict(self.primed)
        for relation, activation in relations.items():
            for name, weight in self.related.get(relation, {}).items():
                primed[name] = max(primed.get(name, 0.0), activation * weight)

        return replace(self, primed=primed)

    def log_ratio(self, labels: Iterable[str]) -> Floats:
        """Return how much likelier each label is than if none were primed, as a logarithm, (n,)."""
        spread = np.array([self.primed.get(name_id(label), 0.0) for label in labels])
        expected = spread / max(1.0, float(spread.sum()))
        return np.log1p(self.share * len(spread) * expected)


NOTHING_EXPECTED = Prior()
