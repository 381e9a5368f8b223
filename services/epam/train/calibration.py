"""How sure a likeness makes: fitted on towns that the network was not trained on."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from services.epam.objects import Names, posteriors
from services.epam.train.crops import Crops

Floats = npt.NDArray[np.float32]
SHARPNESS = np.geomspace(4, 60, 40)
UNKNOWN = np.linspace(0.0, 0.95, 39)
ONCE = np.linspace(-0.2, 0.5, 57)
BINS = 15
VIEWS_A_TOWN = 1000


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The names with their constants, and the figures on the same towns."""

    names: Names
    figures: dict[str, float]


def calibrate(
    seen: Floats, of: Crops, taught: list[str], directions: Floats, size_m: dict[str, tuple[float, float, float]]
) -> Calibrated:
    """Constants by likelihood, for embeddings `seen` (n, d) of the segments `of` held-out towns."""
    plain = Names(
        names=taught,
        directions=directions.astype(float).round(5).tolist(),
        size_m=[size_m[name] for name in taught],
        sharpness=1.0,
        unknown=0.0,
        once=0.0,
    )
    wanted = np.array([taught.index(name) if name in taught else len(taught) for name in of.name])
    cosines = seen @ directions.T
    nothing = np.empty((len(seen), 0), np.float32)
    names = plain
    least = np.inf
    for sharpness in SHARPNESS.tolist():
        for unknown in UNKNOWN.tolist():
            tried = msgspec.structs.replace(plain, sharpness=sharpness, unknown=unknown)
            cost = _cost(posteriors(cosines, nothing, tried), wanted)
            if cost < least:
                least, names = cost, tried
    names, met = _calibrate_once(seen, of, names, cosines)
    posterior = posteriors(cosines, nothing, names)
    known = wanted < len(taught)
    named = posterior.argmax(1)
    return Calibrated(
        names,
        {
            "segments": float(len(seen)),
            "top1": float((named[known] == wanted[known]).mean()),
            "unknown_told": float((named[~known] == len(taught)).mean()),
            "ece": calibration_error(posterior.max(1), named == wanted),
            **met,
        },
    )


def _calibrate_once(seen: Floats, of: Crops, names: Names, cosines: Floats) -> tuple[Names, dict[str, float]]:
    """What to add to the cosine with an object that was met once: the likeliest on meetings of held-out towns.

    In each town every building that was not taught is met once, in one view; all its other views are then to be
    recognised, once with and once without that meeting.
    """
    meetings = [_meetings(seen, of, int(town), names) for town in np.unique(of.view // VIEWS_A_TOWN)]
    trials = [trial for pair in meetings for trial in pair]
    least, best = np.inf, names
    for once in ONCE.tolist():
        tried = msgspec.structs.replace(names, once=once)
        cost = sum(_cost(posteriors(cosines[rows], met, tried), wanted) * len(rows) for rows, met, wanted in trials)
        if cost < least:
            least, best = cost, tried
    figures = {}
    for kind, key in enumerate(("met_once_top1", "never_met_told")):
        right = [
            posteriors(cosines[rows], met, best).argmax(1) == wanted
            for rows, met, wanted in (pair[kind] for pair in meetings if pair)
        ]
        figures[key] = float(np.concatenate(right).mean()) if right else 0.0
    return best, figures


def _meetings(
    seen: Floats, of: Crops, town: int, names: Names
) -> list[tuple[npt.NDArray[np.intp], Floats, npt.NDArray[np.intp]]]:
    """Rows of the segments to recognise, their cosines with what was met (n, m), and which column is right."""
    here = np.flatnonzero((of.view // VIEWS_A_TOWN == town) & ~np.isin(of.name, names.names))
    strangers = sorted(set(of.name[here].tolist()))
    if not strangers:
        return []
    first = np.array([max(here[of.name[here] == name], key=lambda row: of.area_px[row]) for name in strangers])
    rows = np.setdiff1d(here, first)
    column = np.searchsorted(strangers, of.name[rows])
    met = seen[rows] @ seen[first].T
    forgotten = met.copy()
    forgotten[np.arange(len(rows)), column] = -10.0
    taught = len(names.names)
    return [(rows, met, taught + column), (rows, forgotten, np.full(len(rows), taught + len(strangers)))]


def _cost(posterior: npt.NDArray[np.float64], wanted: npt.NDArray[np.intp]) -> float:
    """Mean negative log likelihood."""
    return float(-np.log(posterior[np.arange(len(wanted)), wanted].clip(1e-6)).mean())


def calibration_error(activation: npt.NDArray[np.float64], right: npt.NDArray[np.bool_]) -> float:
    """The expected calibration error, by BINS of equal width (Naeini, Cooper & Hauskrecht 2015)."""
    number = np.minimum((activation * BINS).astype(np.intp), BINS - 1)
    weight = np.bincount(number, minlength=BINS)
    off = np.bincount(number, activation - right, minlength=BINS)
    return float(np.abs(off).sum() / max(weight.sum(), 1))
