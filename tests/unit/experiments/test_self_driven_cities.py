"""Agents that drive themselves through a city, from one given turn of a tour to the next."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cogmap.cli.experiment.city_maps import city_maps
from cogmap.errors import UsageError
from cogmap.experiments.city_maps import self_driven
from cogmap.experiments.city_maps.correction import METHODS
from cogmap.experiments.city_maps.drive import Tour
from cogmap.experiments.city_maps.environment import Environment
from cogmap.experiments.city_maps.guide import Guide, Outcome, Stops, stops
from cogmap.experiments.city_maps.kept import traverse_once
from cogmap.experiments.city_maps.measure import CityMap, Learned
from cogmap.experiments.city_maps.metrics import drive_metrics
from cogmap.experiments.city_maps.streets import Streets
from cogmap.runtime.config import Sections
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import Goal
from cogmap.schemas.sensing import Pose, TruePose
from cogmap.services.sim.odometry import Noise
from cogmap.testing import agent, of_type

SQUARE_M = np.array([(0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (0.0, 60.0)])
TOWN = Environment(
    name="square",
    streets=Streets(SQUARE_M, np.array([(0, 1), (1, 2), (2, 3), (3, 0)])),
    names=("bank", "church"),
    buildings_m=np.array([(30.0, -14.0), (30.0, 74.0)]),
    legs_m=(
        np.array([(30.0, 0.0), (60.0, 0.0), (60.0, 60.0), (30.0, 60.0)]),
        np.array([(30.0, 60.0), (0.0, 60.0), (0.0, 0.0), (30.0, 0.0)]),
    ),
)
QUIET = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0)
AHEAD = Stops(np.array([(30.0, 0.0), (30.0, 40.0)]), np.array([30.0, 70.0]), [True, False])


def _beginning_of_a_tour() -> Sections:
    """The configuration of a drive without noise as far as the second corner."""
    tour = Tour(start=0, backward=False, seed=1)
    configured = self_driven.sections(TOWN, tour, QUIET, "none")
    configured["guide"]["line_m"] = configured["guide"]["line_m"][:5]
    return configured


def _outcome(stops: int, *, is_lost: bool = False) -> Outcome:
    return Outcome(stops, 4, 1, 2, 120.0, 100.0, is_lost, 60.0)


def _drives(outcome: Outcome) -> CityMap:
    return CityMap(TOWN, (Learned({}, 0, {}, {}, {}, dict.fromkeys(METHODS, outcome)),))


def _localized(version: int, pose: Pose) -> Delta:
    here = agent(
        np.array([(pose.x_m, pose.y_m, pose.heading_rad)]),
        x_m=pose.x_m,
        y_m=pose.y_m,
        heading_rad=pose.heading_rad,
    )
    return Delta(
        stamp_ns=version,
        cycle=version,
        version=version,
        phase=Phase.LOCALIZATION,
        operations=[here],
    )


def _shown(guide: Guide, version: int, true: Pose, believed: Pose) -> list[Goal]:
    """The goals that the guide offers of a view."""
    guide.on_pose(TruePose(stamp_ns=version, pose=true, travelled_m=0.0, progress=0.0))
    delta = _localized(version, believed)
    assert guide._graph.apply(delta)
    offers: list[Message] = guide.on_delta(delta)

    goals = []
    for offer in of_type(Offer, offers):
        goals += [each for each in offer.operations if isinstance(each, Goal)]
    return goals


def test_stops_are_turns_and_buildings_no_farther_apart_than_is_seen() -> None:
    line_m = np.array([(0.0, 0.0), (50.0, 1.0), (100.0, 0.0), (100.0, 30.0)])

    found = stops(line_m, np.array([(20.0, 14.0)]))

    assert found.along_m.tolist() == pytest.approx([19.996, 60.0, 100.02, 130.02], abs=0.3)
    assert found.places_m[-2:] == pytest.approx(np.array([(100, 0), (100, 30)]), abs=0.1)
    assert found.is_building == [True, False, False, False]


def test_a_goal_is_as_far_ahead_of_where_the_agent_has_itself() -> None:
    guide = Guide(AHEAD, limit_s=100.0)
    true = Pose(x_m=10.0, y_m=0.0, heading_rad=0.0)
    believed = Pose(x_m=100.0, y_m=50.0, heading_rad=np.pi / 2)

    (goal,) = _shown(guide, 1, true, believed)

    assert (goal.x_m, goal.y_m) == pytest.approx((100.0, 70.0))


def test_once_the_robot_is_there_the_next_goal_is_given() -> None:
    guide = Guide(AHEAD, limit_s=100.0)
    there = Pose(x_m=28.0, y_m=3.0, heading_rad=0.0)

    (goal,) = _shown(guide, 1, there, there)
    outcome = guide.outcome()

    assert (goal.x_m, goal.y_m) == pytest.approx((30.0, 40.0))
    assert (outcome.stops, outcome.buildings, outcome.tour_m) == (1, 1, 30.0)
    assert not guide.is_over


def test_an_agent_drives_itself_past_the_buildings_of_a_tour(tmp_path: Path) -> None:
    configured = _beginning_of_a_tour()
    driven = traverse_once(configured, tmp_path)
    kept = traverse_once(configured, tmp_path)

    outcome = driven.outcome
    assert outcome is not None
    assert outcome.is_finished
    assert outcome.buildings == 2
    assert 0.8 < outcome.driven_m / outcome.tour_m < 1.3
    assert np.hypot(*(driven.buildings_m - TOWN.buildings_m).T).max() < 6.0
    assert kept.outcome == outcome


def test_a_robot_whose_motor_is_slow_ends_by_time_before_its_last_goal() -> None:
    configured = _beginning_of_a_tour()
    configured["motor"] = {"cruise_m_s": 0.5}
    configured["guide"]["limit_s"] = 20.0

    outcome = self_driven.traverse(configured).outcome

    assert outcome is not None
    assert not outcome.is_finished
    assert outcome.duration_s == pytest.approx(20.0, abs=1.0)
    assert 4.0 < outcome.driven_m < 10.0


def test_views_nearer_to_each_other_add_up_to_the_noise_of_an_agent_led() -> None:
    noise = Noise(speed=0.1, turn=0.2, drift_rad_per_sqrt_m=0.01)
    tour = Tour(start=0, backward=False, seed=1)

    own = self_driven.sections(TOWN, tour, noise, "none")["sim"]["noise"]

    views = 5.0 / 2.0
    assert own["speed"] ** 2 / views == pytest.approx(0.1**2)
    assert own["turn"] ** 2 / views == pytest.approx(0.2**2)
    assert own["drift_rad_per_sqrt_m"] == 0.01


def test_drives_that_ended_early_or_lost_are_counted_and_named() -> None:
    maps = [_drives(_outcome(4)), _drives(_outcome(3, is_lost=True))]

    found = drive_metrics(maps)

    assert found["drives_unfinished_corrected"] == 1
    assert found["drives_lost_corrected"] == 1
    assert found["goals_reached_corrected"] == 7
    assert found["goals_given"] == 8
    assert found["way_over_tour_corrected"] == pytest.approx(1.2)
    assert "3 of 4" in str(found["map_02_traversal_01_corrected_unfinished"])
    assert "map_01_traversal_01_corrected_unfinished" not in found


@pytest.mark.parametrize("option", [["--cameras"], ["--live"], ["--noise-drawn", "leg"]])
def test_what_takes_an_agent_that_is_led_is_refused(option: list[str], tmp_path: Path) -> None:
    words = ["--driven", "--out", str(tmp_path), *option]

    result = CliRunner().invoke(city_maps, words)

    assert isinstance(result.exception, UsageError)
    assert option[0] in str(result.exception)


def test_another_city_is_another_drive(tmp_path: Path) -> None:
    tour = Tour(start=0, backward=False, seed=1)
    moved = replace(TOWN, buildings_m=TOWN.buildings_m + 1.0)

    one = self_driven.sections(TOWN, tour, QUIET, "none")
    other = self_driven.sections(moved, tour, QUIET, "none")

    assert one["guide"] != other["guide"]
