"""When the agent last looked at the ground ahead of where it was."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import PathColumn, Self
from cogmap.services.codelets.planning.network import Here

LOOK_M = 20.0
BESIDE_M = 4.0
# While it looks for so long it does not know yet whether what was there has gone.
DECIDES_S = 10.0


def looked_ago_s(path: Floats, agent: Self, since_s: float, here: Here) -> Floats:
    """(w, h): how long ago the agent looked at each cell from within LOOK_M, by the (n, k) rows of
    its path; infinite where that was not within the last `since_s`.
    """
    ago_s = agent.stamp_ns * 1e-9 - path[:, PathColumn.LAST_S]
    is_late = (ago_s >= DECIDES_S) & (ago_s <= since_s)
    rows = path[is_late]

    distance_m = np.arange(0.0, LOOK_M + here.cell_m, here.cell_m)
    heading_rad = rows[:, PathColumn.HEADING_RAD, None]
    x_m = rows[:, PathColumn.X_M, None] + distance_m * np.cos(heading_rad)
    y_m = rows[:, PathColumn.Y_M, None] + distance_m * np.sin(heading_rad)
    positions_m = np.stack([x_m, y_m], axis=-1).reshape(-1, 2)

    lately = here.least(positions_m, np.repeat(ago_s[is_late], len(distance_m)))
    side = 2 * round(BESIDE_M / here.cell_m) + 1
    least_s: Floats = ndimage.minimum_filter(lately, side, mode="constant", cval=np.inf)
    return least_s
