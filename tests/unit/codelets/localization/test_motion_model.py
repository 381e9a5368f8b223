"""Localization by one sense alone, with biased motion, and after being carried elsewhere."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest

from benchmarks.localization.loop import LocalizationLoop
from benchmarks.localization.senses import Moment
from cogmap.schemas.array import Array
from cogmap.schemas.nodes import Object, PathIntegration, Self
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.localization.misfits import MISFITS_TO_RELOCALIZE
from cogmap.testing import agent as self_node
from cogmap.testing import graph_of, percept, task
from cogmap.testing import landmark as object_node
from tests.support.world.scenes import run

PLACES = {"mill": (20.0, 0.0), "tower": (0.0, 25.0), "church": (-15.0, -10.0), "inn": (30.0, 30.0)}
Pose = tuple[float, float, float]
UNKNOWN_BEARING = {"bearing_sd_rad": 2 * math.pi}
CONFIG = Config(landmarks="points")
A_METRE = np.array([[1.0, 0.0, 1.0, 0.1, 0.0]])
TWO = ("mill", "tower")
THREE = ("mill", "tower", "church")
UNKNOWN_RANGE = {"range_sd_m": 1e3}


def _agent(
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    sd: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Self:
    samples = np.random.default_rng(3).normal(pose, sd, (1000, 3))
    x_m, y_m, heading_rad = pose
    return self_node(
        samples,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        odometry=PathIntegration(x_m=x_m, y_m=y_m, heading_rad=heading_rad),
        stamp_ns=0,
    )


def _known(*labels: str, sd_m: float = 0.01) -> list[Object]:
    rng = np.random.default_rng(4)
    known = []
    for label in labels:
        samples_m = rng.normal(PLACES[label], sd_m, (200, 2))
        known.append(object_node(label, samples_m, sightings=50))
    return known


def _seen(pose: Pose, label: str, **facts: float) -> Percept:
    x_m, y_m, heading_rad = pose
    off_x_m = PLACES[label][0] - x_m
    off_y_m = PLACES[label][1] - y_m
    bearing_rad = math.remainder(math.atan2(off_y_m, off_x_m) - heading_rad, math.tau)
    return percept(label, bearing_rad, math.hypot(off_x_m, off_y_m), **facts)


def _ahead(pose: Pose, distance_m: float = 1.0) -> Pose:
    x_m, y_m, heading_rad = pose
    moved_x_m = distance_m * math.cos(heading_rad)
    moved_y_m = distance_m * math.sin(heading_rad)
    return x_m + moved_x_m, y_m + moved_y_m, heading_rad


def _move(
    agent: Self, number: int, landmarks: list[Object], seen: Iterable[Percept], config: Config
) -> Self:
    """The agent after a step of a metre and a look."""
    asked = task(
        "localization",
        f"{number}/l",
        motions=Array.of(A_METRE),
        since_ns=agent.stamp_ns,
        percepts=list(seen),
        stamp_ns=number,
    )

    found, _ = run(asked, graph_of(agent, *landmarks), config).operations
    assert isinstance(found, Self)
    return found


def _off_m(agent: Self, true: Pose) -> float:
    return math.dist((agent.x_m, agent.y_m), true[:2])


def test_a_kidnapped_agent_relocalizes_by_landmarks_in_view() -> None:
    agent = _agent()
    true = (60.0, -40.0, 2.0)
    for number in range(1, 30):
        true = _ahead(true)
        seen = [_seen(true, "mill"), _seen(true, "tower")]
        agent = _move(agent, number, _known(*THREE), seen, CONFIG)

    assert _off_m(agent, true) < 1.0
    assert not agent.misfits.is_lost


def test_a_kidnapped_agent_relocalizes_by_landmarks_seen_one_at_a_time() -> None:
    loop = LocalizationLoop((0.0, 0.0, 0.0), PLACES)
    labels = tuple(PLACES)
    true = (60.0, -40.0, 2.0)
    for number in range(1, 30):
        true = _ahead(true)
        seen = [_seen(true, labels[number % 4])]
        loop.live(Moment(float(number), A_METRE, seen, True))
    loop.close()

    assert math.dist(loop.pose[:2], true[:2]) < 2.0


def _looking(views: int) -> Self:
    """An agent that goes straight ahead, and sees two landmarks as from nowhere on the map."""
    agent = _agent()
    for number in range(1, views + 1):
        seen = [percept("mill", 0.5, 5.0), percept("tower", -0.5, 5.0)]
        agent = _move(agent, number, _known("mill", "tower"), seen, CONFIG)

    return agent


def _carried(
    sd_m: float = 0.01,
    labels: tuple[str, ...] = TWO,
    views: int = MISFITS_TO_RELOCALIZE + 2,
    **facts: float,
) -> Self:
    """An agent that was carried off, and sees landmarks whose own places are known to `sd_m`."""
    agent = _agent()
    true = (-40.0, 10.0, 2.0)
    known = _known(*labels, sd_m=sd_m)
    for number in range(1, views + 1):
        true = _ahead(true)
        seen = [_seen(true, label, **facts) for label in labels]
        agent = _move(agent, number, known, seen, CONFIG)

    return agent


@pytest.mark.parametrize(("sd_m", "is_moved"), [(0.01, True), (3.0, False)])
def test_two_landmarks_carry_the_agent_off_only_where_their_places_are_sure(
    sd_m: float, is_moved: bool
) -> None:
    was_moved = _carried(sd_m).odometry.x_m < 0.0
    assert was_moved == is_moved


@pytest.mark.parametrize(("certainty", "is_moved"), [(0.95, True), (0.75, False)])
def test_two_landmarks_carry_the_agent_off_only_where_it_is_sure_which_ones_they_are(
    certainty: float, is_moved: bool
) -> None:
    was_moved = _carried(certainty=certainty).odometry.x_m < 0.0
    assert was_moved == is_moved


@pytest.mark.parametrize(
    ("labels", "certainty", "is_moved"),
    [(THREE, 0.95, True), (THREE, 0.75, False), (TWO, 0.95, False)],
    ids=["three", "three unsure ones", "two"],
)
def test_a_few_views_are_enough_where_three_landmarks_agree(
    labels: tuple[str, ...], certainty: float, is_moved: bool
) -> None:
    was_moved = _carried(labels=labels, views=4, certainty=certainty).odometry.x_m < 0.0
    assert was_moved == is_moved


def test_two_ranges_which_fit_two_places_carry_the_agent_to_neither() -> None:
    agent = _carried(**UNKNOWN_BEARING)

    assert agent.odometry.y_m == pytest.approx(0.0, abs=0.1)


def test_landmarks_that_fit_no_pose_together_move_nobody() -> None:
    agent = _looking(views=40)

    assert _off_m(agent, (40.0, 0.0, 0.0)) < 5.0
    assert (agent.odometry.x_m, agent.odometry.y_m) == pytest.approx((40.0, 0.0), abs=0.01)


def test_an_agent_that_can_be_nowhere_else_says_so_and_is_not_lost() -> None:
    patience = MISFITS_TO_RELOCALIZE
    assert _looking(views=patience).misfits.is_lost

    agent = _looking(views=2 * patience)
    assert not agent.misfits.is_lost
    assert agent.misfits.not_elsewhere_ns == agent.stamp_ns


def test_one_landmark_that_does_not_fit_for_long_is_another() -> None:
    agent = _agent()
    for number in range(1, MISFITS_TO_RELOCALIZE + 1):
        agent = _move(agent, number, _known("mill"), [percept("mill", 2.0, 60.0)], CONFIG)

    assert agent.misfits.not_elsewhere_ns == agent.stamp_ns


def test_the_distance_that_an_agent_was_carried_is_a_step_of_its_path() -> None:
    agent = _agent()
    true = (-20.0, 30.0, 2.0)
    for number in range(1, 12):
        true = _ahead(true)
        seen = [_seen(true, "mill"), _seen(true, "tower")]
        agent = _move(agent, number, _known("mill", "tower"), seen, CONFIG)

    assert _off_m(agent, true) < 0.5
    assert agent.odometry.x_m == pytest.approx(agent.x_m, abs=5.0)
    assert agent.odometry.y_m == pytest.approx(agent.y_m, abs=5.0)


def test_ranges_alone_to_three_landmarks_give_the_position() -> None:
    true = (1.5, 0.8, 0.0)
    agent = _agent((0.0, 0.0, 0.0), (1.0, 1.0, 0.01))
    seen = [_seen(true, label, **UNKNOWN_BEARING) for label in THREE]
    found = _move(agent, 1, _known(*THREE), seen, CONFIG)

    assert _off_m(found, true) < 0.4


def test_bearings_alone_to_three_landmarks_give_the_position() -> None:
    true = (1.5, 0.8, 0.0)
    agent = _agent((0.0, 0.0, 0.0), (1.0, 1.0, 0.01))
    seen = [_seen(true, label, **UNKNOWN_RANGE) for label in THREE]
    found = _move(agent, 1, _known(*THREE), seen, CONFIG)

    assert _off_m(found, true) < 0.5


@pytest.mark.parametrize("alone", [UNKNOWN_BEARING, {"range_sd_m": 1e3}], ids=["range", "bearing"])
def test_range_or_bearing_alone_places_a_new_landmark_from_several_places(
    alone: dict[str, float],
) -> None:
    config = Config(landmarks="points", landmark_samples=4000)
    places_m = ((0.0, 0.0), (4.0, 3.0), (8.0, 2.0), (12.0, 6.0), (8.0, 9.0), (4.0, 12.0))

    known: list[Object] = []
    for number, (x_m, y_m) in enumerate(places_m):
        pose = (x_m, y_m, 0.0)
        agent = _agent(pose, (0.01, 0.01, 0.002))
        seen = [_seen(pose, "mill", **alone)]
        codelet = "landmark" if known else "object_place"
        asked = task(codelet, f"{number}/mill", percepts=seen, stamp_ns=number)

        found, _ = run(asked, graph_of(agent, *known), config).operations
        assert isinstance(found, Object)
        known = [found]

    (mill,) = known
    assert (mill.x_m, mill.y_m) == pytest.approx(PLACES["mill"], abs=1.5)


def test_landmarks_calibrate_wheels_that_always_slip() -> None:
    def off_m(speed_gain_sd: float) -> float:
        config = Config(
            samples=1000,
            landmarks="points",
            speed_gain_sd=speed_gain_sd,
        )
        agent = _agent()
        true = (0.0, 0.0, 0.0)
        for number in range(1, 60):
            true = _ahead(true, 0.8)  # where self-motion says a metre
            in_view = ("mill", "tower") if number <= 44 else ()
            seen = [_seen(true, label) for label in in_view]
            agent = _move(agent, number, _known("mill", "tower"), seen, config)

        return _off_m(agent, true)

    assert off_m(0.0) > 2.0
    assert off_m(0.2) < 1.2


def test_what_is_not_seen_costs_nothing() -> None:
    agent = _agent()
    seen = [_seen((1.0, 0.0, 0.0), "mill")]

    few = _move(agent, 1, _known("mill"), seen, CONFIG)
    many = _move(agent, 1, _known("mill", "tower", "church", "inn"), seen, CONFIG)

    assert few == many
