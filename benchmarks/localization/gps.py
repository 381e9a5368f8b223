"""How far paths are from GPS that has gaps and jumps: aligned robustly, on the same fixes for all.

Each path is turned and moved onto the fixes by Cauchy's weights, whose scale follows its median
error, so that neither jumps nor the drift of a path decide. A fix farther than JUMP_M from every
map's path, once aligned, is a jump of GPS: it is left out for all paths alike, and counted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import transform_from

# GPS without corrections of 2000 scatters by some metres; under these trees it jumps by 3 to 8 m
# from one fix to the next, and stays away for seconds.
JUMP_M = 8.0
LEAST_SCALE_M = 1.0
ROUNDS = 20


def at_fixes(
    stamps_s: Floats, path: Floats, fixes: Floats, antenna_m: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Return where an antenna so far ahead and left of the pose was at each of (m, 3) fixes, (m,
    2), on a path of (n, 3) poses at (n,) stamps.
    """
    columns = []
    for column in (path[:, 0], path[:, 1], np.unwrap(path[:, 2])):
        columns.append(np.interp(fixes[:, 0], stamps_s, column))

    return transform_from(np.column_stack(columns), np.tile(antenna_m, (len(fixes), 1)))


def errors_m(positions_m: Floats, fixes_m: Floats) -> Floats:
    """Return (m,) distances of positions from the fixes, (m, 2) each, once aligned with them."""
    weights = np.ones(len(fixes_m))
    for _ in range(ROUNDS):
        away_m = _distances_m(positions_m, fixes_m, weights)
        scale_m = max(LEAST_SCALE_M, float(np.median(away_m)))
        weights = 1 / (1 + np.square(away_m / scale_m))

    return _distances_m(positions_m, fixes_m, weights)


def are_jumps(errors: Sequence[Floats]) -> Booleans:
    """Return which of m fixes no map explains, by the (m,) errors of each map's path."""
    nearest_m = np.min(errors, axis=0)
    is_jump: Booleans = nearest_m > JUMP_M
    return is_jump


def _distances_m(positions_m: Floats, fixes_m: Floats, weights: Floats) -> Floats:
    """Align by weighted least squares (Umeyama 1991, without scale), and measure."""
    share = weights / weights.sum()
    middle_m = share @ positions_m
    fixes_middle_m = share @ fixes_m
    from_middle_m = positions_m - middle_m
    fixes_from_middle_m = fixes_m - fixes_middle_m

    across = (share[:, None] * fixes_from_middle_m).T @ from_middle_m
    turn_rad = np.arctan2(across[1, 0] - across[0, 1], across[0, 0] + across[1, 1])
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    residual_m = from_middle_m @ turn.T - fixes_from_middle_m
    distances_m: Floats = np.hypot(residual_m[:, 0], residual_m[:, 1])
    return distances_m
