"""A reverse replay of the agent's: the shifts of place fields, and the changes of synapses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.polylines import distances_along
from cogmap.schemas.cognition import Replay

MIN_PAIRS = 3


@dataclass(frozen=True)
class Replayed:
    """A reverse replay: `shifts_m` (n,) of the place fields in its order, and changes of synapses.

    `stamps_ns` (n,) is when the agent was at each place, `before_m` and `after_m` (n, 2) where it
    took itself to have been, and `behind_m` (n,) the length of the path, as it was taken to be,
    from the newest place back to each. `apart_m` (m,) is the distance of the fields of each pair of
    place cells before, `nearer_m` (m,) by how much they come nearer. `close` marks the pairs near
    enough, before and after, for exp(-k d) to be about linear: less than 1/k apart.
    """

    passes: int
    decay_per_m: float
    stamps_ns: Indices
    before_m: Floats
    after_m: Floats
    behind_m: Floats
    shifts_m: Floats
    apart_m: Floats
    nearer_m: Floats
    strength_changes: Floats
    close: Booleans

    @classmethod
    def of(cls, replay: Replay) -> Replayed:
        """Make it from the event on the bus."""
        before_m = np.asarray(replay.positions_m.numpy(), float)
        shifts_m = np.asarray(replay.shifts_m.numpy(), float)
        after_m = before_m + shifts_m
        pairs = np.asarray(replay.pairs.numpy(), np.int64)
        apart_before_m = _distances_m(before_m, pairs)
        apart_after_m = _distances_m(after_m, pairs)
        farthest_m = np.maximum(apart_before_m, apart_after_m)

        return cls(
            passes=replay.replays,
            decay_per_m=replay.decay_per_m,
            stamps_ns=np.asarray(replay.stamps_ns.numpy(), np.int64),
            before_m=before_m,
            after_m=after_m,
            behind_m=distances_along(before_m),
            shifts_m=np.hypot(*shifts_m.T),
            apart_m=apart_before_m,
            nearer_m=apart_before_m - apart_after_m,
            strength_changes=np.asarray(replay.strength_changes.numpy(), float),
            close=farthest_m * replay.decay_per_m < 1,
        )


def strength_fit(name: str, replay: Replayed, pairs: Booleans) -> dict[str, float]:
    """Fit the change of strength to the metres by which fields come nearer, over the marked pairs:
    the number of pairs, the slope and the correlation, 0 if there are too few or they are all
    alike. Keys end with `name`.
    """
    nearer_m = replay.nearer_m[pairs]
    changes = replay.strength_changes[pairs]
    slope = 0.0
    correlation = 0.0

    if len(nearer_m) >= MIN_PAIRS and min(np.ptp(nearer_m), np.ptp(changes)) > 0:
        slope = float(np.polyfit(nearer_m, changes, 1)[0])
        correlation = float(np.corrcoef(nearer_m, changes)[0, 1])

    return {
        name: float(len(nearer_m)),
        f"strength_change_per_m_{name}": slope,
        f"strength_and_shift_correlation_{name}": correlation,
    }


def _distances_m(positions_m: Floats, pairs: Indices) -> Floats:
    """Return the distance between the two places of each of (m, 2) pairs, (m,)."""
    first, second = pairs.T
    offsets_m = positions_m[first] - positions_m[second]
    return np.asarray(np.hypot(*offsets_m.T))
