"""Calibrates object recognition: fits the probability that a cosine means on towns that the network
was not trained on.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.services.epam.recognition.objects import Prototypes, posteriors, probability
from cogmap.training.crops import VIEWS_A_TOWN, Crops
from cogmap.training.rendering.reader import INVENTED

Rows = npt.NDArray[np.intp]
SHARPNESS = np.geomspace(4, 60, 40).tolist()
UNKNOWN = np.linspace(0.0, 0.95, 39).tolist()
EVIDENCE = np.geomspace(0.2, 2.0, 40).tolist()
BINS = 15
IMPOSSIBLE_COSINE = -10.0


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The prototypes with their constants, and the metrics on the same towns."""

    prototypes: Prototypes
    metrics: dict[str, float]


@dataclass(frozen=True, eq=False)
class Trial:
    """Segments of buildings to recognize: cosines with what was taught (n, k) and learned (n, m),
    and the column of the right answer (n,).
    """

    taught: Singles
    novel: Singles
    wanted: Rows

    def posteriors(self, prototypes: Prototypes) -> Floats:
        """Return the posteriors (n, k + m + 2)."""
        building = np.ones(len(self.wanted))
        return posteriors(self.taught, self.novel, building, prototypes)

    def cost(self, prototypes: Prototypes) -> float:
        """Return the negative log likelihood of the right answers."""
        rows = np.arange(len(self.wanted))
        return _surprise(self.posteriors(prototypes)[rows, self.wanted])

    def correct(self, prototypes: Prototypes) -> Booleans:
        """Return which of the segments are recognized, (n,)."""
        return np.asarray(self.posteriors(prototypes).argmax(1) == self.wanted)


def calibrate(
    embeddings: Singles, log_odds: Singles, of: Crops, prototypes: Prototypes
) -> Calibrated:
    """Return `prototypes` with the likeliest constants, for embeddings (n, d) and log odds (n, 2)
    of the segments `of` held-out towns.
    """
    building = of.name != ""
    shown = np.stack([building, of.whole], 1)

    def evidence_cost(tried: Prototypes) -> float:
        return _surprise(np.abs(probability(log_odds, tried) - ~shown))

    candidates = (msgspec.structs.replace(prototypes, evidence=value) for value in EVIDENCE)
    prototypes = min(candidates, key=evidence_cost)

    # The column of the right posterior: that of its name, or the one after all names.
    columns = {name: number for number, name in enumerate(prototypes.names)}
    column = np.array([columns.get(name, len(columns)) for name in of.name.tolist()])
    cosines = embeddings @ np.asarray(prototypes.directions, np.float32).T

    rows = np.flatnonzero(building)
    # As if one of each had been there besides: a trial's few towns may have no strangers at all.
    taught_rows = int(np.count_nonzero(column[rows] < len(columns)))
    share = (taught_rows + 1) / (len(rows) + 2)
    prototypes = msgspec.structs.replace(prototypes, taught_share=share)
    taught = Trial(cosines[rows], _none_learned(len(rows)), column[rows])
    prototypes = _likeliest(prototypes, [taught], "sharpness", "unknown")

    known, unknown = _encounters(embeddings, cosines, of)
    prototypes = _likeliest(prototypes, [*known, *unknown], "novel_sharpness", "novel_unknown")

    shows_building = probability(log_odds, prototypes)[:, 0]
    posterior = posteriors(cosines, _none_learned(len(cosines)), shows_building, prototypes)

    metrics = _metrics(posterior, of, column)
    metrics["novel_top1"] = _accuracy(prototypes, known)
    metrics["novel_unknown_recall"] = _accuracy(prototypes, unknown)
    return Calibrated(prototypes, metrics)


def _none_learned(count: int) -> Singles:
    """Return the cosines (count, 0) of that many segments with learned labels: there are none."""
    return np.empty((count, 0), np.float32)


def _likeliest(
    prototypes: Prototypes, trials: list[Trial], sharpness: str, unknown: str
) -> Prototypes:
    """Return `prototypes` with the values of these two fields that make `trials` likeliest."""

    def cost(tried: Prototypes) -> float:
        return sum(trial.cost(tried) for trial in trials)

    tried = (
        msgspec.structs.replace(prototypes, **{sharpness: sharpness_tried, unknown: unknown_tried})
        for sharpness_tried, unknown_tried in itertools.product(SHARPNESS, UNKNOWN)
    )
    return min(tried, key=cost)


def _metrics(posterior: Floats, of: Crops, column: Rows) -> dict[str, float]:
    """Return the metrics of segments with these posteriors (n, k + 2) and right columns (n,)."""
    # The posteriors of each label taught, and of any other thing.
    taught = posterior.shape[1] - 2
    unlabelled = posterior[:, taught:].sum(1, keepdims=True)
    claims = np.concatenate([posterior[:, :taught], unlabelled], axis=1)
    claimed = claims.argmax(1)
    correct = claimed == column

    building = of.name != ""
    known = column < taught
    unknown = building & ~known
    background = posterior[:, -1]
    return {
        "segments": float(len(claims)),
        "top1": _share(correct[known]),
        "unknown_recall": _share(claimed[unknown] == taught),
        "background_recall": _share(background[~building] > 0.5),
        "building_recall": _share(background[building] < 0.5),
        "ece": calibration_error(claims.max(1), correct),
    }


def _share(of: Booleans) -> float:
    """Return the share that is true, NaN of none."""
    return float(of.mean()) if of.size else float("nan")


def _accuracy(prototypes: Prototypes, trials: Iterable[Trial]) -> float:
    correct = [trial.correct(prototypes) for trial in trials]
    return _share(np.concatenate(correct)) if correct else 0.0


def _encounters(
    embeddings: Singles, cosines: Singles, of: Crops
) -> tuple[list[Trial], list[Trial]]:
    """Make trials: every unlabelled building of a town is encountered once, in its largest segment;
    all its others are to be recognized, once with and once without that encounter.
    """
    known = []
    unknown = []
    town_of = of.view // VIEWS_A_TOWN
    invented = np.char.startswith(of.name, INVENTED)
    _, taught = cosines.shape

    for town in np.unique(town_of[invented]):
        here = np.flatnonzero((town_of == town) & invented)
        names = sorted(set(of.name[here].tolist()))
        first = []
        for name in names:
            segments = here[of.name[here] == name]
            first.append(int(segments[of.area_px[segments].argmax()]))

        rows = np.setdiff1d(here, first)
        column = np.searchsorted(names, of.name[rows])
        novel = embeddings[rows] @ embeddings[first].T
        known.append(Trial(cosines[rows], novel, taught + column))

        without = novel.copy()
        without[np.arange(len(rows)), column] = IMPOSSIBLE_COSINE
        after_all = np.full(len(rows), taught + len(names))
        unknown.append(Trial(cosines[rows], without, after_all))

    return known, unknown


def _surprise(likelihood: Floats) -> float:
    return -float(np.log(likelihood.clip(1e-6)).sum())


def calibration_error(activation: Floats, correct: Booleans) -> float:
    """Return the expected calibration error, by BINS of equal width (Naeini, Cooper & Hauskrecht
    2015).
    """
    number = np.minimum((activation * BINS).astype(np.intp), BINS - 1)
    gap = np.bincount(number, activation - correct, minlength=BINS)
    return float(np.abs(gap).sum() / max(len(activation), 1))
