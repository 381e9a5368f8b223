"""The predictions in a recording as numbers, beside those of a drive."""

from __future__ import annotations

import math

from cogmap.experiments.predictions.drive import Drive, Metrics
from cogmap.experiments.predictions.drive import metrics_of as metrics_of_drive
from cogmap.experiments.predictions.measure import Estimate, Found

OF_DRIVE = "drive_"


def metrics_of(found: Found, drive: Drive | None) -> Metrics:
    """Return what was measured of a recording: values with the ends of their 95 % intervals
    (`_low`, `_high`) and the chance of them without the effect (`_p`), None if there is too little
    to tell. Keys of a drive begin with OF_DRIVE.
    """
    recording = found.recording
    metrics: Metrics = {
        "recording": recording.name,
        "session_description": recording.description,
        "units": len(recording.spikes_s),
        "place_cells": len(found.cells),
        "loop_m": found.loop.length_m,
        "loop_closed_s": found.loop.closed_s,
        "rest_before_s": found.rest_before_s,
        "rest_after_s": found.rest_after_s,
        **_replays(found),
        **_shifts(found),
        **_synapses(found),
    }
    if drive is not None:
        of_drive = metrics_of_drive(drive)
        metrics |= {f"{OF_DRIVE}{key}": value for key, value in of_drive.items()}
    return metrics


def _replays(found: Found) -> Metrics:
    replays = found.replays
    return {
        "events": found.candidates,
        "events_tested_since_closure": replays.tested,
        "replays_forward": replays.forward,
        "replays_reverse": replays.reverse,
        "replays_reverse_by_chance": replays.by_chance,
        "replays_reverse_of_a_field": float(replays.replays.mean()),
        "revisits_of_a_field": float(replays.revisits.mean()),
        **_estimate("place_replays_over_revisits", replays.ratio),
        "replays_verdict": replays.verdict.value,
    }


def _shifts(found: Found) -> Metrics:
    shifts = found.shifts
    mean_m: float | None = None
    usual_m: float | None = None
    if len(shifts.shift_m):
        mean_m = float(abs(shifts.shift_m).mean())
        usual_m = float(shifts.usual_m.mean())
    return {
        "shift_cells": len(shifts.shift_m),
        "shift_mean_abs_m": mean_m,
        "shift_usual_from_pass_to_pass_m": usual_m,
        **_estimate("shift_excess_m", shifts.excess),
        **_estimate("shift_decline_rho", shifts.decline),
        "shifts_verdict": shifts.verdict.value,
    }


def _synapses(found: Found) -> Metrics:
    synapses = found.synapses
    decay = _estimate("cofiring_decay_rho", synapses.decay)
    return {
        "pairs": len(synapses.change),
        "close_pairs": int(synapses.close.sum()),
        **_estimate("cofiring_per_m_nearer", synapses.slope),
        "cofiring_rho": synapses.correlation,
        **{key: value for key, value in decay.items() if not key.endswith(("_low", "_high"))},
        "synapses_verdict": synapses.verdict.value,
    }


def _estimate(name: str, estimate: Estimate | None) -> Metrics:
    values = (None,) * 4 if estimate is None else estimate
    names = (name, f"{name}_low", f"{name}_high", f"{name}_p")
    known = [None if value is None or math.isnan(value) else value for value in values]
    return dict(zip(names, known, strict=True))
