"""Sensing and recognising on renderings of a town that the committed model has not seen."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from schemas.array import Array
from schemas.sensing import Building, Calibration, Percept, View
from services.epam.module import Config, build
from services.sensory.disparity import DepthFromStereo
from services.sensory.rectify import rectification
from services.sim import town
from services.sim.renderings import Views, render

SEED, COUNT = 3, 16


@pytest.fixture(scope="module")
def views() -> Views:
    return render(SEED, COUNT)


@pytest.fixture(scope="module")
def recognised(views: Views) -> list[tuple[int, Percept]]:
    """The percepts of all views, each with the number of its view."""
    rectified = rectification(_calibration(views))
    matcher, module = DepthFromStereo(rectified.calibration, 2.5), build(Config(), "epam")
    found = []
    for number in range(COUNT):
        left, right = rectified.apply(views["left"][number], views["right"][number])
        depth_m = matcher.depth_m(left, right)
        view = View(frame=number, image=Array.of(left), depth_m=Array.of(depth_m), calibration=rectified.calibration)
        found += [(number, percept) for percept in module.feed(view)[0].objects]
    return found


def _calibration(views: Views) -> Calibration:
    return msgspec.json.decode(views["calibration"].tobytes(), type=Calibration)


def test_depth_of_buildings_within_thirty_metres_is_right_to_four_percent(views: Views) -> None:
    rectified = rectification(_calibration(views))
    matcher = DepthFromStereo(rectified.calibration, 2.5)
    errors = []
    for left, right, true_m, label in zip(views["left"], views["right"], views["depth_m"], views["label"], strict=True):
        depth_m = matcher.depth_m(*rectified.apply(left, right))
        sure = (depth_m > 0) & (label > 0) & (true_m > 3) & (true_m < 30)
        errors.append(depth_m[sure] / true_m[sure] - 1)
    error = np.concatenate(errors)
    assert np.median(np.abs(error)) < 0.04
    assert abs(np.median(error)) < 0.01


def test_nearly_all_percepts_name_what_is_there(views: Views, recognised: list[tuple[int, Percept]]) -> None:
    names = views["names"].tolist()
    right = [1 + names.index(percept.label) in views["label"][number] for number, percept in recognised]
    assert len(right) > 1.5 * COUNT
    assert np.mean(right) > 0.95


def test_most_large_buildings_are_recognised(views: Views, recognised: list[tuple[int, Percept]]) -> None:
    names, found = views["names"].tolist(), {(number, percept.label) for number, percept in recognised}
    large = [
        (number, names[label - 1])
        for number in range(COUNT)
        for label, pixels in zip(*np.unique(views["label"][number], return_counts=True), strict=True)
        if label > 0 and pixels > 0.03 * 320 * 240
    ]
    assert np.mean([seen in found for seen in large]) > 0.6


def test_centres_are_right_to_a_metre_and_as_sure_as_they_say(
    views: Views, recognised: list[tuple[int, Percept]]
) -> None:
    buildings = {building.name: building for building in town.generate(SEED).message().buildings}
    placed = [
        (percept, *_offset(percept, buildings[percept.label], views["pose"][number]))
        for number, percept in recognised
        if percept.label in buildings
    ]
    assert np.median([math.hypot(x_m, y_m) for _, x_m, y_m in placed]) < 1.2
    bearing = [math.atan2(y_m, percept.range_m) / percept.bearing_sd_rad for percept, _, y_m in placed]
    reach = [x_m / percept.range_sd_m for percept, x_m, _ in placed]
    assert np.median(np.abs(bearing)) < 1.2
    assert np.median(np.abs(reach)) < 1.2


def _offset(percept: Percept, building: Building, pose: np.ndarray) -> tuple[float, float]:
    """How far the percept is from the building's centre, along its line of sight and to the left of it."""
    direction = pose[2] + percept.bearing_rad
    away = (
        pose[0] + percept.range_m * math.cos(direction) - building.pose.x_m,
        pose[1] + percept.range_m * math.sin(direction) - building.pose.y_m,
    )
    cos, sin = math.cos(direction), math.sin(direction)
    return cos * away[0] + sin * away[1], -sin * away[0] + cos * away[1]
