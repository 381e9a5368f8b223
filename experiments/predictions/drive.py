"""What a drive predicts of place cells, from the messages of its log (paper §5.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import LogError
from cogmap.experiments.predictions.replayed import Replayed, strength_fit
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.polylines import distances_along
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Direction, Replay, RouteReplay
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import LoopClosure

FOLLOWED = (topics.REPLAY, topics.ROUTE_REPLAY, topics.DELTA)
# Of all pairs of places, those of at most so many places: a tenth of a million pairs and more.
MAX_PLACES = 500
# Distances of fields for which changes are averaged, in units of 1/k.
DISTANCES = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0)
END_SHARE = 0.1
Metrics = dict[str, float | int | str | None]


@dataclass(frozen=True)
class Places:
    """The places that were replayed, the oldest first: `along_m` (n,) is the length of the
    corrected path from the first of them, `replays` and `revisits` (n,) how often each was.
    """

    along_m: Floats
    replays: Indices
    revisits: Indices


@dataclass(frozen=True)
class ByDistance:
    """The changes of synapses between all places that one correction moved, by the distance of
    their fields before: the mean absolute change of `pairs` (k,) pairs at `distance_m` (k,).
    """

    distance_m: Floats
    pairs: Indices
    mean_change: Floats


@dataclass(frozen=True)
class Drive:
    """What a log shows. `rule` is the setting `codelets.correct`, by which the path was corrected;
    `revisits` is how often the agent came back to known ground and closed a loop by it.
    """

    rule: str
    corrections: list[Replayed]
    revisits: int
    places: Places
    by_distance: ByDistance
    route_replays: dict[Direction, int]

    @property
    def passes(self) -> int:
        """Return how often a loop was replayed, over all corrections."""
        return sum(replayed.passes for replayed in self.corrections)


class Follower:
    """Takes the messages of a log on FOLLOWED, in their order. A place counts as revisited again if
    closures of it lie `revisit_s` apart.
    """

    def __init__(self, rule: str, revisit_s: float) -> None:
        self._rule = rule
        self._revisit_ns = round(revisit_s * 1e9)
        self._corrections: list[Replayed] = []
        self._closures: dict[str, LoopClosure] = {}
        self._route_replays = dict.fromkeys(Direction, 0)

    def update(self, message: Message) -> None:
        """Take account of one message."""
        match message:
            case Replay():
                self._corrections.append(Replayed.of(message))
            case RouteReplay():
                self._route_replays[message.direction] += 1
            case Delta():
                for operation in message.operations:
                    if isinstance(operation, LoopClosure):
                        self._closures[operation.id] = operation

    def drive(self, source: str) -> Drive:
        """Return what the messages of `source` show. Raises LogError if no loop was closed."""
        if not self._corrections:
            raise LogError(
                f"{source} holds no {topics.REPLAY.name}: no loop was closed, and without one "
                "nothing is replayed; give a drive that returns, as `cogmap run --laps 2` does"
            )

        revisits = _revisits(list(self._closures.values()), self._revisit_ns)
        return Drive(
            rule=self._rule,
            corrections=self._corrections,
            revisits=len(revisits),
            places=_places(self._corrections, revisits),
            by_distance=_by_distance(self._corrections[0]),
            route_replays=self._route_replays,
        )


def _revisits(closures: list[LoopClosure], revisit_ns: int) -> list[tuple[int, int]]:
    """Return, for each time that the agent came back to known ground, when it had been there
    before: from the first place to the last, by the accepted closures.
    """
    accepted = [closure for closure in closures if closure.accepted]
    accepted.sort(key=lambda closure: closure.to_ns)
    spans: list[tuple[int, int]] = []
    before: LoopClosure | None = None
    for closure in accepted:
        goes_on = (
            before is not None
            and closure.to_ns - before.to_ns < revisit_ns
            and abs(closure.from_ns - before.from_ns) < revisit_ns
        )
        first_ns, last_ns = spans.pop() if goes_on else (closure.from_ns, closure.from_ns)
        spans.append((min(first_ns, closure.from_ns), max(last_ns, closure.from_ns)))
        before = closure
    return spans


def _places(corrections: list[Replayed], revisits: list[tuple[int, int]]) -> Places:
    """Count replays and revisits by place, a place by when the agent was there first."""
    stamps_ns = np.unique(np.concatenate([each.stamps_ns for each in corrections]))
    positions_m = np.zeros((len(stamps_ns), 2))
    replays = np.zeros(len(stamps_ns), np.int64)
    for replayed in corrections:
        rows = np.searchsorted(stamps_ns, replayed.stamps_ns)
        replays[rows] += replayed.passes
        positions_m[rows] = replayed.after_m

    counts = np.zeros(len(stamps_ns), np.int64)
    for first_ns, last_ns in revisits:
        counts += (stamps_ns >= first_ns) & (stamps_ns <= last_ns)
    return Places(distances_along(positions_m), replays, counts)


def _by_distance(replayed: Replayed) -> ByDistance:
    """Average the changes of exp(-k d) over all pairs of places of a correction."""
    step = -(-len(replayed.before_m) // MAX_PLACES)
    before_m = replayed.before_m[::step]
    after_m = replayed.after_m[::step]
    first, second = np.triu_indices(len(before_m), k=1)
    apart_m = np.hypot(*(before_m[first] - before_m[second]).T)
    apart_after_m = np.hypot(*(after_m[first] - after_m[second]).T)
    decay = replayed.decay_per_m
    changes = np.abs(np.exp(-decay * apart_after_m) - np.exp(-decay * apart_m))

    edges_m = np.array(DISTANCES) / decay
    inside = (apart_m < edges_m[-1]).nonzero()[0]
    number = np.digitize(apart_m[inside], edges_m) - 1
    pairs = np.bincount(number, minlength=len(edges_m) - 1)
    sums = np.bincount(number, changes[inside], minlength=len(edges_m) - 1)
    known = pairs > 0
    middles_m = (edges_m[1:] + edges_m[:-1]) / 2
    return ByDistance(middles_m[known], pairs[known], sums[known] / pairs[known])


def metrics_of(drive: Drive) -> Metrics:
    """Return the three predictions as numbers: replays beside revisits, shifts by the distance from
    the closure, and changes of synapses. The last two are of the first correction.
    """
    first = drive.corrections[0]
    return {
        "correction_rule": drive.rule,
        **_counts(drive),
        **_shifts(first),
        **_synapses(first, drive.by_distance),
    }


def _counts(drive: Drive) -> Metrics:
    places = drive.places
    seen_again = places.revisits > 0
    replays_a_place: float | None = None
    revisits_a_place: float | None = None
    ratio: float | None = None
    if seen_again.any():
        replays_a_place = float(places.replays[seen_again].mean())
        revisits_a_place = float(places.revisits[seen_again].mean())
        ratio = replays_a_place / revisits_a_place
    return {
        "corrections": len(drive.corrections),
        "replays": drive.passes,
        "revisits": drive.revisits,
        "replays_over_revisits": drive.passes / drive.revisits if drive.revisits else None,
        "corrections_over_revisits": (
            len(drive.corrections) / drive.revisits if drive.revisits else None
        ),
        "places_replayed": len(places.replays),
        "places_revisited": int(seen_again.sum()),
        "replays_of_a_revisited_place": replays_a_place,
        "revisits_of_a_revisited_place": revisits_a_place,
        "place_replays_over_revisits": ratio,
        "route_replays_forward": drive.route_replays[Direction.FORWARD],
        "route_replays_reverse": drive.route_replays[Direction.REVERSE],
    }


def _shifts(replayed: Replayed) -> Metrics:
    """Describe the shifts of one correction along its loop, which is `loop_m` long."""
    count = max(1, round(END_SHARE * len(replayed.shifts_m)))
    correlation: float | None = None
    if np.ptp(replayed.shifts_m) > 0 and np.ptp(replayed.behind_m) > 0:
        correlation = float(np.corrcoef(replayed.behind_m, replayed.shifts_m)[0, 1])
    return {
        "loop_m": float(replayed.behind_m[-1]),
        "shift_mean_m": float(replayed.shifts_m.mean()),
        "shift_max_m": float(replayed.shifts_m.max()),
        "shift_near_closure_m": float(replayed.shifts_m[:count].mean()),
        "shift_far_from_closure_m": float(replayed.shifts_m[-count:].mean()),
        "shift_and_distance_from_closure_correlation": correlation,
    }


def _synapses(replayed: Replayed, by_distance: ByDistance) -> Metrics:
    metrics: Metrics = {"synapse_decay_per_m": replayed.decay_per_m}
    metrics |= strength_fit("close_pairs", replayed, replayed.close)
    metrics |= strength_fit("all_pairs", replayed, np.ones_like(replayed.close))
    rows = zip(by_distance.distance_m, by_distance.mean_change, strict=True)
    for distance_m, change in rows:
        metrics[f"strength_change_mean_abs_at_{distance_m:g}_m"] = float(change)
    return metrics
