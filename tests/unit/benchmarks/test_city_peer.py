"""Cities' maps by gtsam from the senses that an agent had."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.map_correction.city_peer import Senses, summary
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Percepts, PlaceMatch, SelfMotion
from cogmap.services.player.public import sighting

SECOND_NS = 1_000_000_000
MUSEUM_M = np.array([10.0, 6.0])


def _senses(turn_gain: float) -> Senses:
    """A square of 20 m, driven once and a bit, past a museum; turns are measured wrong."""
    senses = Senses(("museum", "bank"))
    pose = np.zeros(3)
    for number in range(1, 22):
        turn_rad = np.pi / 2 if number % 4 == 0 else 0.0
        pose[:2] += 5.0 * np.array([np.cos(pose[2]), np.sin(pose[2])])
        pose[2] += turn_rad

        stamp_ns = number * SECOND_NS
        row = [[5.0, 0.0, 1.0, 0.05, 0.01], [0.0, turn_gain * turn_rad, 1.0, 0.01, 0.1]]
        motion = Array.of(np.array(row), "<f8")
        senses.on_self_motion(
            SelfMotion(stamp_ns=stamp_ns, frame=number, since_ns=stamp_ns, motions=motion)
        )

        away_m = MUSEUM_M - pose[:2]
        bearing_rad = float(np.arctan2(away_m[1], away_m[0]) - pose[2])
        bearing_rad = float(np.remainder(bearing_rad + np.pi, 2 * np.pi) - np.pi)
        range_m = float(np.hypot(*away_m))
        percept = sighting("museum", bearing_rad, range_m, bearing_sd_rad=0.01, range_sd_m=0.1)
        same = [PlaceMatch(frame=4, view_ns=4 * SECOND_NS, score=1.0)] if number == 20 else []
        road = Array.of(np.empty((0, 2), np.float32))
        senses.on_percepts(
            Percepts(stamp_ns=stamp_ns, frame=number, objects=[percept], road_m=road, matches=same)
        )
    return senses


def test_gtsam_maps_the_buildings_that_the_agent_saw() -> None:
    pytest.importorskip("gtsam")

    museum_m, bank_m = _senses(turn_gain=1.1).buildings_m()

    assert np.hypot(*(museum_m - MUSEUM_M)) < 1.0
    assert np.isnan(bank_m).all()


def test_ratios_are_of_the_means_over_the_maps() -> None:
    first = {"ours_km2": 1.0, "gtsam_km2": 4.0, "fused_alone_km2": 4.0}
    second = {"ours_km2": 3.0, "gtsam_km2": 1.0, "fused_alone_km2": 4.0}

    metrics = summary([first, second])

    assert metrics["ours_over_gtsam"] == pytest.approx(0.8)
    assert metrics["ours_over_fused_alone"] == pytest.approx(0.5)
    assert metrics["ours_better_share"] == 0.5
    assert metrics["map_02_gtsam_km2"] == 1.0
