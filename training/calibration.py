"""How sure a likeness makes: fitted on towns that the network was not trained on."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from services.epam.recognition.objects import Prototypes, posteriors, probability
from training.crops import Crops

Floats = npt.NDArray[np.float32]
Rows = npt.NDArray[np.intp]
SHARPNESS = np.geomspace(4, 60, 40).tolist()
UNKNOWN = np.linspace(0.0, 0.95, 39).tolist()
EVIDENCE = np.geomspace(0.2, 2.0, 40).tolist()
BINS = 15
VIEWS_A_TOWN = 1000
NEVER = -10.0


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The names with their constants, and the figures on the same towns."""

    names: Prototypes
    figures: dict[str, float]


@dataclass(frozen=True, eq=False)
class Trial:
    """Segments to recognise: cosines with what was taught (n, k) and met (n, m), and which column
    is right (n,).
    """

    taught: Floats
    met: Floats
    wanted: Rows

    def posteriors(self, names: Prototypes) -> npt.NDArray[np.float64]:
        """Of buildings, as these segments are."""
        return posteriors(self.taught, self.met, np.ones(len(self.wanted)), names)

    def cost(self, names: Prototypes) -> float:
        """Negative log likelihood."""
        return _surprise(self.posteriors(names)[np.arange(len(self.wanted)), self.wanted])

    def right(self, names: Prototypes) -> npt.NDArray[np.bool_]:
        """Which of the segments are recognised."""
        return np.asarray(self.posteriors(names).argmax(1) == self.wanted)


def calibrate(seen: Floats, odds: Floats, of: Crops, names: Prototypes) -> Calibrated:
    """`names` with the likeliest constants, for embeddings `seen` (n, d) and log `odds` (n, 2) of
    the segments `of` held-out towns.
    """
    shows = np.stack([of.name != "", of.whole], 1)
    names = min(
        (msgspec.structs.replace(names, evidence=evidence) for evidence in EVIDENCE),
        key=lambda tried: _surprise(np.abs(probability(odds, tried) - ~shows)),
    )
    building = np.flatnonzero(shows[:, 0])
    taught = names.names
    cosines = seen @ np.asarray(names.directions, np.float32).T
    column = np.array([taught.index(name) if name in taught else len(taught) for name in of.name])
    first = Trial(cosines[building], np.empty((len(building), 0), np.float32), column[building])
    names = _likeliest(names, [first], "sharpness", "unknown")
    known, strangers = _meetings(seen, cosines, of)
    names = _likeliest(names, [*known, *strangers], "novel_sharpness", "novel_unknown")
    posterior = posteriors(
        cosines, np.empty((len(seen), 0), np.float32), probability(odds, names)[:, 0], names
    )
    return Calibrated(
        names, _figures(posterior, of, column, len(taught)) | _met_figures(names, known, strangers)
    )


def _likeliest(names: Prototypes, trials: list[Trial], sharpness: str, unknown: str) -> Prototypes:
    tried = (
        msgspec.structs.replace(names, **{sharpness: sharp, unknown: at})
        for sharp, at in itertools.product(SHARPNESS, UNKNOWN)
    )
    return min(tried, key=lambda one: sum(trial.cost(one) for trial in trials))


def _figures(
    posterior: npt.NDArray[np.float64], of: Crops, column: Rows, taught: int
) -> dict[str, float]:
    """Of segments whose posterior (n, taught + 2) is given."""
    said = np.concatenate(
        [posterior[:, :taught], posterior[:, taught:].sum(1, keepdims=True)], axis=1
    )
    named = said.argmax(1)
    shows = of.name != ""
    known = column < taught
    return {
        "segments": float(len(said)),
        "top1": float((named[known] == column[known]).mean()),
        "unknown_told": float((named[shows & ~known] == taught).mean()),
        "no_building_told": float((posterior[~shows, -1] > 0.5).mean()),
        "building_told": float((posterior[shows, -1] < 0.5).mean()),
        "ece": calibration_error(said.max(1), named == column),
    }


def _met_figures(names: Prototypes, known: list[Trial], strangers: list[Trial]) -> dict[str, float]:
    return {
        key: float(np.concatenate([trial.right(names) for trial in trials]).mean())
        if trials
        else 0.0
        for key, trials in (("met_once_top1", known), ("never_met_told", strangers))
    }


def _meetings(seen: Floats, cosines: Floats, of: Crops) -> tuple[list[Trial], list[Trial]]:
    """In each town every building that was not taught is met once, in one view; all its other views
    are then to be recognised, once with and once without that meeting.
    """
    known = []
    strangers = []
    for town in np.unique(of.view // VIEWS_A_TOWN):
        here = np.flatnonzero(
            (of.view // VIEWS_A_TOWN == town) & np.char.startswith(of.name, "invented-")
        )
        if not len(here):
            continue
        names = sorted(set(of.name[here].tolist()))
        first = np.array(
            [max(here[of.name[here] == name], key=lambda row: of.area_px[row]) for name in names]
        )
        rows = np.setdiff1d(here, first)
        column = np.searchsorted(names, of.name[rows])
        met = seen[rows] @ seen[first].T
        forgotten = met.copy()
        forgotten[np.arange(len(rows)), column] = NEVER
        taught = cosines.shape[1]
        known.append(Trial(cosines[rows], met, taught + column))
        strangers.append(Trial(cosines[rows], forgotten, np.full(len(rows), taught + len(names))))
    return known, strangers


def _surprise(likelihood: npt.NDArray[np.float64]) -> float:
    return float(-np.log(likelihood.clip(1e-6)).sum())


def calibration_error(activation: npt.NDArray[np.float64], right: npt.NDArray[np.bool_]) -> float:
    """The expected calibration error, by BINS of equal width (Naeini, Cooper & Hauskrecht 2015)."""
    number = np.minimum((activation * BINS).astype(np.intp), BINS - 1)
    weight = np.bincount(number, minlength=BINS)
    off = np.bincount(number, activation - right, minlength=BINS)
    return float(np.abs(off).sum() / max(weight.sum(), 1))
