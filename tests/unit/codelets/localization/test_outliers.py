"""Percepts and landmarks that do not fit move nobody, and make nobody surer."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.services.codelets.config import Config
from cogmap.testing import agent, percept
from tests.support.world.landmarks import (
    house,
    localized,
    motions,
    normal_samples,
    pose_of,
    samples_of,
)

FIVE_METRES = (5.0, 0.0, 1.0, 0.5, 0.0)


def test_a_landmark_whose_place_is_hardly_known_corrects_nothing() -> None:
    found = localized(
        agent(),
        house(20.0, 0.0, sd_m=6.0),
        motions=motions(FIVE_METRES),
        percepts=[percept("house", 0.0, 12.0)],
    )

    assert found.kept_share == 1.0


def test_where_all_samples_are_unlikely_the_pose_is_still_one_of_them() -> None:
    elsewhere = percept("house", 2.0, 500.0, range_sd_m=1e-3, bearing_sd_rad=1e-3)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = localized(
            agent(),
            house(20.0, 0.0, 1e-6),
            config=Config(samples=100, kept_samples=50),
            motions=motions((5.0, 0.0, 1.0, 0.01, 0.01)),
            percepts=[elsewhere],
        )
    x_m, y_m, heading_rad = pose_of(found)

    assert len(samples_of(found)) >= 1
    assert x_m == pytest.approx(5.0, abs=0.1)
    assert abs(y_m) + abs(heading_rad) < 0.2


def test_one_landmark_taken_for_another_does_not_outvote_the_rest() -> None:
    known = {"a": -5.0, "b": 0.0, "c": 5.0}
    landmarks = [house(20.0, y_m, 0.05, label) for label, y_m in known.items()]
    seen = [percept("c", -1.0, 40.0)]
    for label in ("a", "b"):
        y_m = known[label]
        seen.append(percept(label, math.atan2(y_m, 15.0), math.hypot(y_m, 15.0)))

    found = localized(
        agent(),
        *landmarks,
        config=Config(),
        motions=motions((5.0, 0.0, 1.0, 0.5, 0.05)),
        percepts=seen,
    )

    assert (found.x_m, found.y_m) == pytest.approx((5.0, 0.0), abs=0.15)


def _x_m(sightings: int) -> float:
    """Where the agent takes itself to be by a landmark that was seen so often."""
    found = localized(
        agent(),
        house(20.0, 0.0, sightings=sightings),
        motions=motions(FIVE_METRES),
        percepts=[percept("house", 0.0, 14.0, range_sd_m=0.2)],
    )
    return found.x_m


def test_a_landmark_that_was_seen_but_once_moves_nobody() -> None:
    assert _x_m(sightings=1) == pytest.approx(5.0, abs=0.05)
    assert _x_m(sightings=2) > 5.5


def test_one_landmark_that_does_not_fit_leaves_the_pose_as_certain() -> None:
    looker = agent(normal_samples(0.3, 0.3, 0.01, count=1000))
    for number in range(20):
        looker = localized(
            looker,
            house(20.0, 0.0),
            motions=motions((0.1, 0.0, 1.0, 0.0, 0.0)),
            percepts=[percept("house", 2.0, 50.0)],
            identifier=f"{number}/localization",
        )

    assert looker.misfits.count == 20
    assert looker.x_sd_m < 0.4
