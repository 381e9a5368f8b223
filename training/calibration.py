"""Calibrates object recognition: which probability a cosine means, fitted on towns that the network
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
        """The posteriors (n, k + m + 2)."""
        building = np.ones(len(self.wanted))

        return posteriors(self.taught, self.novel, building, prototypes)

    def cost(self, prototypes: Prototypes) -> float:
        """The negative log likelihood of the right answers."""
        posterior = self.posteriors(prototypes)
        rows = np.arange(len(self.wanted))

        likelihood = posterior[rows, self.wanted]
        return _surprise(likelihood)

    def correct(self, prototypes: Prototypes) -> Booleans:
        """Which of the segments are recognized, (n,)."""
        posterior = self.posteriors(prototypes)
        claimed = posterior.argmax(1)
        return np.asarray(claimed == self.wanted)


@dataclass(frozen=True, eq=False)
class _Encounters:
    """Trials in which unlabelled buildings were encountered once before, and never."""

    known: list[Trial]
    unknown: list[Trial]


def calibrate(
    embeddings: Singles, log_odds: Singles, of: Crops, prototypes: Prototypes
) -> Calibrated:
    """Return `prototypes` with the likeliest constants, for embeddings (n, d) and log odds (n, 2)
    of the segments `of` held-out towns.
    """
    building = of.name != ""
    shown = np.stack([building, of.whole], 1)
    prototypes = _with_evidence(prototypes, log_odds, shown)

    directions = np.asarray(prototypes.directions, np.float32)
    cosines = embeddings @ directions.T
    column = _columns(of, prototypes)

    rows = np.flatnonzero(building)
    taught = Trial(cosines[rows], _none_learned(len(rows)), column[rows])
    prototypes = _likeliest(prototypes, [taught], "sharpness", "unknown")

    encounters = _encounters(embeddings, cosines, of)
    trials = [*encounters.known, *encounters.unknown]
    prototypes = _likeliest(prototypes, trials, "novel_sharpness", "novel_unknown")

    shows_building = probability(log_odds, prototypes)[:, 0]
    posterior = posteriors(cosines, _none_learned(len(cosines)), shows_building, prototypes)

    metrics = _metrics(posterior, of, column)
    metrics |= _novel_metrics(prototypes, encounters)
    return Calibrated(prototypes, metrics)


def _none_learned(count: int) -> Singles:
    """(count, 0): the cosines of so many segments with what was learned, where that is nothing."""
    return np.empty((count, 0), np.float32)


def _with_evidence(prototypes: Prototypes, log_odds: Singles, shown: Booleans) -> Prototypes:
    """`prototypes` with the factor that makes log odds (n, 2) of what is `shown` likeliest."""

    def cost(tried: Prototypes) -> float:
        probabilities = probability(log_odds, tried)
        likelihood = np.abs(probabilities - ~shown)
        return _surprise(likelihood)

    tried = (msgspec.structs.replace(prototypes, evidence=evidence) for evidence in EVIDENCE)
    return min(tried, key=cost)


def _likeliest(
    prototypes: Prototypes, trials: list[Trial], sharpness: str, unknown: str
) -> Prototypes:
    """`prototypes` with the values of these two fields that make `trials` likeliest."""

    def cost(tried: Prototypes) -> float:
        return sum(trial.cost(tried) for trial in trials)

    tried = (
        msgspec.structs.replace(prototypes, **{sharpness: sharpness_tried, unknown: unknown_tried})
        for sharpness_tried, unknown_tried in itertools.product(SHARPNESS, UNKNOWN)
    )
    return min(tried, key=cost)


def _columns(of: Crops, prototypes: Prototypes) -> Rows:
    """The column of the right posterior (n,): that of its name, or the one after all names."""
    columns = {name: column for column, name in enumerate(prototypes.names)}
    after_all = len(columns)

    right = []
    for name in of.name.tolist():
        right.append(columns.get(name, after_all))
    return np.array(right)


def _metrics(posterior: Floats, of: Crops, column: Rows) -> dict[str, float]:
    """Of segments with these posteriors (n, k + 2) and the columns that are right (n,)."""
    taught = posterior.shape[1] - 2
    claims = _claims(posterior, taught)
    claimed = claims.argmax(1)
    correct = claimed == column

    building = of.name != ""
    known = column < taught
    unknown = building & ~known
    claimed_background = posterior[:, -1] > 0.5
    claimed_building = posterior[:, -1] < 0.5

    return {
        "segments": float(len(claims)),
        "top1": _share(correct[known]),
        "unknown_recall": _share(claimed[unknown] == taught),
        "background_recall": _share(claimed_background[~building]),
        "building_recall": _share(claimed_building[building]),
        "ece": calibration_error(claims.max(1), correct),
    }


def _claims(posterior: Floats, taught: int) -> Floats:
    """The posteriors (n, taught + 1) of each label taught, and of any other thing."""
    of_labels = posterior[:, :taught]
    unlabelled = posterior[:, taught:].sum(1, keepdims=True)
    return np.concatenate([of_labels, unlabelled], axis=1)


def _share(of: Booleans) -> float:
    return float(of.mean())


def _novel_metrics(prototypes: Prototypes, encounters: _Encounters) -> dict[str, float]:
    return {
        "novel_top1": _accuracy(prototypes, encounters.known),
        "novel_unknown_recall": _accuracy(prototypes, encounters.unknown),
    }


def _accuracy(prototypes: Prototypes, trials: Iterable[Trial]) -> float:
    correct = [trial.correct(prototypes) for trial in trials]
    if not correct:
        return 0.0
    return _share(np.concatenate(correct))


def _encounters(embeddings: Singles, cosines: Singles, of: Crops) -> _Encounters:
    """In each town every unlabelled building is encountered once, in its largest segment; all its
    other segments are then to be recognized, once with and once without that encounter.
    """
    encounters = _Encounters([], [])
    town_of = of.view // VIEWS_A_TOWN
    invented = np.char.startswith(of.name, INVENTED)

    for town in np.unique(town_of):
        here = np.flatnonzero((town_of == town) & invented)
        if len(here):
            _encounter(here, embeddings, cosines, of, encounters)
    return encounters


def _encounter(
    here: Rows, embeddings: Singles, cosines: Singles, of: Crops, encounters: _Encounters
) -> None:
    """Add the trials of the segments `here`, all of unlabelled buildings of one town."""
    names = sorted(set(of.name[here].tolist()))
    first = _first_encounters(here, names, of)
    rows = np.setdiff1d(here, first)
    column = np.searchsorted(names, of.name[rows])

    of_taught = cosines[rows]
    _, taught = cosines.shape

    novel = embeddings[rows] @ embeddings[first].T
    known_trial = Trial(of_taught, novel, taught + column)
    encounters.known.append(known_trial)

    after_all = taught + len(names)
    unknown = np.full(len(rows), after_all)
    unknown_trial = Trial(of_taught, _without(novel, column), unknown)
    encounters.unknown.append(unknown_trial)


def _without(novel: Singles, column: Rows) -> Singles:
    """The cosines (n, m) of segments whose own building, in `column` (n,), was not encountered."""
    rows = np.arange(len(novel))
    never = novel.copy()
    never[rows, column] = IMPOSSIBLE_COSINE
    return never


def _first_encounters(here: Rows, names: list[str], of: Crops) -> list[int]:
    """The largest of the segments `here` of each of the buildings `names`."""
    names_here = of.name[here]
    first = []
    for name in names:
        segments = here[names_here == name]
        first.append(_largest(segments, of))
    return first


def _largest(segments: Rows, of: Crops) -> int:
    """The first of the largest of these segments."""
    area_px = of.area_px[segments]
    return int(segments[area_px.argmax()])


def _surprise(likelihood: Floats) -> float:
    log_likelihood = np.log(likelihood.clip(1e-6))
    return -float(log_likelihood.sum())


def calibration_error(activation: Floats, correct: Booleans) -> float:
    """Return the expected calibration error, by BINS of equal width (Naeini, Cooper & Hauskrecht
    2015).
    """
    scaled = activation * BINS
    number = np.minimum(scaled.astype(np.intp), BINS - 1)
    count = np.bincount(number, minlength=BINS)

    excess = activation - correct
    gap = np.bincount(number, excess, minlength=BINS)
    total_gap = np.abs(gap).sum()

    total = max(count.sum(), 1)
    return float(total_gap / total)
