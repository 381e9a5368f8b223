"""How evidence accumulates over sightings: of links that are cut or free, of cells that are road or
obstacles. Pure.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats, Singles

# Of links: two sure views cut one that is unknown, four one that was free for long. A free view
# counts half as much: six sure ones free what was cut.
CUT_AT = 2.0
MAX_CUT = 3.0
MAX_FREE = 2.0
CUT_GAIN = 1.0
FREE_GAIN = 0.5
# Of cells: each sure view counts as much as all before it; four that see nothing leave nothing.
CELL_GAIN = 0.5
FORGOTTEN_BELOW = 0.1
# A smaller change is not worth the bytes of writing it.
MIN_CHANGE = 0.02


def accumulated(evidence: Singles, cut: Floats, free: Floats) -> Singles:
    """Update the evidence of links after a view in which they appeared `cut`, or otherwise `free`,
    each 0 to 1, by how sure that was; evidence above 0 is for free, below 0 for cut.

    It saturates, so that a change counts after a few views, however long the link was otherwise.
    """
    change = np.where(cut > 0, -CUT_GAIN * cut, FREE_GAIN * free)
    after = (evidence + change).clip(-MAX_CUT, MAX_FREE)
    return _if_changed(evidence, after)


def weights_of(evidence: Singles) -> Singles:
    """Compute the weights of links from their evidence: 1 if it is not below 0, and 0 if they are
    cut.

    It takes more than one sighting to cut a link.
    """
    weight = (1 + evidence / CUT_AT).clip(0.0, 1.0)
    return weight.astype(np.float32)


def blended(shares: Singles, seen: Floats, certainty: Floats) -> Singles:
    """Update the shares of cells, 0 to 1, after a view in which they appeared as `seen`, weighed by
    `certainty`, 0 if they were not in view: a running mean over the last few views.
    """
    after = shares + CELL_GAIN * certainty * (seen - shares)
    after[(after < FORGOTTEN_BELOW) & (seen == 0)] = 0.0
    return _if_changed(shares, after)


def _if_changed(before: Singles, after: Floats) -> Singles:
    """Take `after` for what differs enough from `before`, and `before` for the rest."""
    is_changed = np.abs(after - before) > MIN_CHANGE
    return np.where(is_changed, after, before).astype(np.float32)
