"""Sensing and recognition on renderings of a town that the committed networks have not seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from schemas import topics
from schemas.sensing import Building, Learned, Percept, Percepts
from services.epam.module import Config, build
from services.sim.layout import town
from tests.support.rendered import seen
from training.rendering.towns import Views, render_town

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
    module = build(Config(), "epam")
    said = [message for view in seen(views) for message in module.feed(view)]
    return [
        (said.frame, percept)
        for said in said
        if isinstance(said, Percepts)
        for percept in said.objects
    ]


def test_depth_of_buildings_within_30_m_has_errors_under_4_percent(views: Views) -> None:
    errors = []
    for view, true_m, label in zip(seen(views), views["depth_m"], views["label"], strict=True):
        depth_m = view.depth_m.numpy()
        sure = (depth_m > 0) & (label > 0) & (true_m > 3) & (true_m < 30)
        errors.append(depth_m[sure] / true_m[sure] - 1)
    error = np.concatenate(errors)

    assert np.median(np.abs(error)) < 0.04
    assert abs(np.median(error)) < 0.01


def test_nearly_all_percepts_have_the_right_label(
    views: Views, recognized: list[tuple[int, Percept]]
) -> None:
    names = views["names"].tolist()
    known = [(number, percept) for number, percept in recognized if percept.label in names]
    right = [1 + names.index(percept.label) in views["label"][number] for number, percept in known]

    assert len(right) > 2 * COUNT
    assert len(known) > 0.9 * len(recognized)
    assert np.mean(right) > 0.95


def test_nearly_all_large_buildings_are_recognized(
    views: Views, recognized: list[tuple[int, Percept]]
) -> None:
    names = views["names"].tolist()
    found = {(number, percept.label) for number, percept in recognized}
    large = [
        (number, names[label - 1])
        for number in range(COUNT)
        for label, pixels in zip(
            *np.unique(views["label"][number], return_counts=True), strict=True
        )
        if label > 0 and pixels > LARGE_PX
    ]

    assert len(large) > COUNT
    assert np.mean([seen in found for seen in large]) > 0.85


def test_centres_have_errors_of_a_metre_or_two_as_their_deviations_claim(
    views: Views, recognized: list[tuple[int, Percept]]
) -> None:
    buildings = {building.name: building for building in town.generate(SEED).message().buildings}
    placed = [
        (percept, *_offset(percept, buildings[percept.label], views["pose"][number]))
        for number, percept in recognized
        if percept.label in buildings and percept.range_m < 40
    ]

    assert np.median([math.hypot(x_m, y_m) for _, x_m, y_m in placed]) < 1.5

    bearing = [
        math.atan2(y_m, percept.range_m) / percept.bearing_sd_rad for percept, _, y_m in placed
    ]
    reach = [x_m / percept.range_sd_m for percept, x_m, _ in placed]

    assert np.median(np.abs(bearing)) < 1.2
    assert np.median(np.abs(reach)) < 1.2


def _offset(percept: Percept, building: Building, pose: np.ndarray) -> tuple[float, float]:
    """How far the percept is from the building's centre, along its line of sight and to the left of
    it.
    """
    direction = pose[2] + percept.bearing_rad
    away = (
        pose[0] + percept.range_m * math.cos(direction) - building.pose.x_m,
        pose[1] + percept.range_m * math.sin(direction) - building.pose.y_m,
    )
    cos = math.cos(direction)
    sin = math.sin(direction)
    return cos * away[0] + sin * away[1], -sin * away[0] + cos * away[1]


def test_unlabelled_buildings_get_nodes_and_are_recognized_again() -> None:
    views = render_town(4004, 20, 28)
    module = build(Config(), "epam")
    truths = views["label"]
    labels: dict[str, list[str]] = {}
    learned: list[str] = []
    for view in seen(views):
        for said in module.feed(view):
            if isinstance(said, Learned):
                learned += [known.label for known in said.objects]
            if isinstance(said, Percepts):
                for percept in (one for one in said.objects if one.activation > RECOGNIZED):
                    labels.setdefault(
                        _shown(percept, truths[said.frame], views["names"].tolist()), []
                    ).append(percept.label)
    again = {
        name: given
        for name, given in labels.items()
        if name.startswith("invented") and len(given) > 1
    }
    kept = [label == given[0] for given in again.values() for label in given[1:]]

    assert list(dict.fromkeys(learned)) == [
        f"new-building-{1 + number}" for number in range(len(set(learned)))
    ]

    unlabelled = [name for name in labels if name.startswith("invented")]
    assert 0.7 * len(unlabelled) <= len(set(learned)) <= 1.3 * len(unlabelled)
    assert len(kept) > 20
    assert np.mean(kept) > 0.7


def _shown(percept: Percept, label: np.ndarray, names: list[str]) -> str:
    """The building that fills most of the percept's box."""
    left, top, wide, high = percept.box_px
    count = np.bincount(label[top : top + high, left : left + wide].ravel())
    count[0] = 0
    return names[int(count.argmax()) - 1] if count.any() else "nothing"


def test_perception_declares_the_topics_that_it_publishes() -> None:
    assert build(Config(), "epam").emits == {topics.PERCEPTS, topics.LEARNED}
