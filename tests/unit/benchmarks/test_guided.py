"""When a route counts as driven by guidance."""

from __future__ import annotations

import dataclasses

import pytest

from benchmarks.cognition.guided import STOOD_S, Driven, Route
from cogmap.schemas.sensing import Pose, TruePose

GOOD = Route(
    length_m=120.0,
    taught_away_m=1.0,
    away_m=2.0,
    taught_collisions=0,
    collisions=0,
    schemes=60,
    beside_m=0.4,
)


@pytest.mark.parametrize("bad", [{"away_m": 5.1}, {"collisions": 1}, {"taught_away_m": 4.1}])
def test_a_route_counts_that_is_driven_twice_to_its_end_without_a_collision(
    bad: dict[str, float],
) -> None:
    assert GOOD.is_guided
    assert not dataclasses.replace(GOOD, **bad).is_guided  # type: ignore[arg-type]


def _pose(at_s: float, x_m: float) -> TruePose:
    pose = Pose(x_m=x_m, y_m=0.0, heading_rad=0.0)
    return TruePose(stamp_ns=round(at_s * 1e9), pose=pose, travelled_m=x_m, progress=0.0)


def test_a_drive_is_over_once_the_robot_has_stood_for_long() -> None:
    driven = Driven()
    driven.on_pose(_pose(0.0, 0.0))
    driven.on_pose(_pose(10.0, 5.0))
    driven.on_pose(_pose(9.9 + STOOD_S, 5.01))
    was_over = driven.is_over
    driven.on_pose(_pose(10.0 + STOOD_S, 5.02))

    assert not was_over
    assert driven.is_over
    assert driven.path_m == [(0.0, 0.0), (5.0, 0.0)]
