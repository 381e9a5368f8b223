"""Sensing and recognition on renderings of a town that the committed networks have not seen."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from cogmap.geometry.se2 import rotate
from cogmap.graph.likeness import odds
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Appearance, Building, Percept, Percepts
from cogmap.services.epam.module import Config, build
from cogmap.services.sim.layout import town
from cogmap.testing import of_type
from cogmap.training.rendering.towns import Views, render_town
from tests.support.world.rendered import seen

SEED = 4003
COUNT = 24
LARGE_PX = 2300
RECOGNIZED = 0.7


@pytest.fixture(scope="module")
def views() -> Views:
    return render_town(SEED, COUNT)


@pytest.fixture(scope="module")
def recognized(views: Views) -> list[tuple[int, Percept]]:
    """The percepts of all views, each with the number of its view."""
    found = []
    for answer in of_type(Percepts, _answers(views)):
        for percept in answer.objects:
            found.append((answer.frame, percept))
    return found


def _answers(views: Views) -> list[Message]:
    """What the module publishes when it sees the views of a town."""
    module = build(Config(), "epam")
    answers = []
    for view in seen(views):
        answers += module.feed(view)
    return answers


def test_depth_of_buildings_within_30_m_has_errors_under_4_percent(views: Views) -> None:
    errors = []
    for view, true_m, label in zip(seen(views), views["depth_m"], views["label"], strict=True):
        depth_m = view.depth_m.numpy()
        of_building = (label > 0) & (true_m > 3) & (true_m < 30)
        known = (depth_m > 0) & of_building
        errors.append(depth_m[known] / true_m[known] - 1)

    error = np.concatenate(errors)
    assert np.median(np.abs(error)) < 0.04
    assert abs(np.median(error)) < 0.01


def test_nearly_all_percepts_have_the_right_name(
    views: Views, recognized: list[tuple[int, Percept]]
) -> None:
    names = views["names"].tolist()
    right = []
    for number, percept in recognized:
        if percept.name in names:
            shown = np.unique(views["label"][number])
            right.append(1 + names.index(percept.name) in shown)

    assert len(right) > 2 * COUNT
    assert len(right) > 0.9 * len(recognized)
    assert np.mean(right) > 0.95


def _large_buildings(views: Views) -> list[tuple[int, str]]:
    """The buildings that fill many pixels of a view: its number and their names."""
    names = views["names"].tolist()
    large = []
    for number in range(COUNT):
        shown, pixels = np.unique(views["label"][number], return_counts=True)
        for label in shown[pixels > LARGE_PX]:
            if label > 0:
                large.append((number, names[label - 1]))
    return large


def test_nearly_all_large_buildings_are_recognized(
    views: Views, recognized: list[tuple[int, Percept]]
) -> None:
    found = {(number, percept.name) for number, percept in recognized}
    large = _large_buildings(views)
    are_found = [building in found for building in large]

    assert len(large) > COUNT
    assert np.mean(are_found) > 0.85


def test_centres_have_errors_of_a_metre_or_two_as_their_deviations_claim(
    views: Views, recognized: list[tuple[int, Percept]]
) -> None:
    buildings = {building.name: building for building in town.generate(SEED).message().buildings}
    errors_m = []
    bearing_scores = []
    range_scores = []
    for number, percept in recognized:
        if percept.name not in buildings or percept.range_m >= 40:
            continue
        x_m, y_m = _offset(percept, buildings[percept.name], views["pose"][number])
        bearing_error_rad = math.atan2(y_m, percept.range_m)

        errors_m.append(math.hypot(x_m, y_m))
        bearing_scores.append(bearing_error_rad / percept.bearing_sd_rad)
        range_scores.append(x_m / percept.range_sd_m)

    assert np.median(errors_m) < 1.5
    assert np.median(np.abs(bearing_scores)) < 1.2
    assert np.median(np.abs(range_scores)) < 1.2


def _offset(percept: Percept, building: Building, pose: np.ndarray) -> tuple[float, float]:
    """How far the percept is from the building's centre, along its line of sight and to the left of
    it.
    """
    direction = pose[2] + percept.bearing_rad
    ahead_m = np.array([percept.range_m, 0.0])
    centre_m = (building.pose.x_m, building.pose.y_m)
    off_m = pose[:2] + rotate(ahead_m, direction) - centre_m

    along_m, left_m = rotate(off_m, -direction).tolist()
    return along_m, left_m


def test_buildings_that_were_not_taught_are_told_apart_by_their_appearance() -> None:
    views = render_town(4004, 30, 28)
    sights = _nameless(views, of_type(Percepts, _answers(views)))
    assert len(sights) > 20

    same = []
    other = []
    for (shown, one), (shown_too, another) in itertools.combinations(sights, 2):
        cosine = float(one.direction.numpy() @ another.direction.numpy())
        (same if shown == shown_too else other).append(odds(cosine, one) > 1.0)

    assert np.mean(same) > 0.5
    assert np.mean(other) < 0.1


def _nameless(views: Views, answers: list[Percepts]) -> list[tuple[str, Appearance]]:
    """The appearances without a name, each with the building that was not taught that it shows."""
    names = views["names"].tolist()
    found = []
    for answer in answers:
        shown = views["label"][answer.frame]
        for percept in answer.objects:
            building = _shown(percept, shown, names)
            is_clear = not percept.name and percept.whole and percept.activation > RECOGNIZED
            if is_clear and percept.appearance is not None and building.startswith("invented"):
                found.append((building, percept.appearance))

    return found


def _shown(percept: Percept, label: np.ndarray, names: list[str]) -> str:
    """The building that fills most of the percept's box."""
    left, top, wide, high = percept.box_px
    box = label[top : top + high, left : left + wide]
    count = np.bincount(box.ravel())
    count[0] = 0
    if not count.any():
        return "nothing"
    return names[int(count.argmax()) - 1]


def test_perception_declares_the_topics_that_it_publishes() -> None:
    module = build(Config(), "epam")

    assert module.emits == {topics.PERCEPTS, topics.LEARNED}
