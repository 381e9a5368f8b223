"""Naming segments by what they look like: what was taught, what was met once, and what is new."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bus.errors import ConfigError
from services.epam.network import Network
from services.epam.objects import DEFAULT_PATH as WEIGHTS
from services.epam.objects import (
    DIMENSIONS,
    GIVES,
    SIDE_PX,
    TAKES,
    Names,
    Recogniser,
    crop,
    load,
    posteriors,
)
from services.sim.catalogue import CATALOGUE


def _direction(number: int, towards: int = 0, share: float = 0.0) -> np.ndarray:
    """The unit vector along axis `number`, turned a little towards another."""
    vector = np.zeros(DIMENSIONS, np.float32)
    vector[number] += 1 - share
    vector[towards] += share
    return vector / np.linalg.norm(vector)


NAMES = Names(
    names=["bakery", "bank"],
    directions=[_direction(0).tolist(), _direction(1).tolist()],
    size_m=[(9.0, 8.0, 6.0), (11.0, 9.0, 10.0)],
    sharpness=20.0,
    unknown=0.5,
    once=0.1,
)


@pytest.fixture
def recogniser() -> Recogniser:
    return Recogniser(Network(WEIGHTS, TAKES, GIVES), NAMES)


def test_what_was_taught_has_its_name_its_size_and_a_high_activation(recogniser: Recogniser) -> None:
    found = recogniser.recognise(_direction(1, 2, 0.1))

    assert (found.label, found.size_m) == ("bank", (11.0, 9.0, 10.0))
    assert found.activation > 0.95


def test_what_is_like_nothing_has_no_label_and_is_known_once_it_was_learned(recogniser: Recogniser) -> None:
    stranger = _direction(5)
    before = recogniser.recognise(stranger)
    recogniser.learn("new-building-1", stranger)
    after = recogniser.recognise(_direction(5, 6, 0.25))

    assert (before.label, before.size_m) == ("", None)
    assert before.activation > 0.9
    assert (after.label, after.size_m) == ("new-building-1", None)
    assert after.activation > 0.9
    assert recogniser.recognise(_direction(9)).label == ""


def test_two_looks_of_one_object_are_one_label_and_their_posteriors_add_up(recogniser: Recogniser) -> None:
    recogniser.learn("new-building-1", _direction(5))
    alone = recogniser.recognise(_direction(5, 6, 0.45)).activation
    recogniser.learn("new-building-1", _direction(6))
    both = recogniser.recognise(_direction(5, 6, 0.45))

    assert both.label == "new-building-1"
    assert both.activation > alone
    assert [label for label, _ in recogniser.learned] == ["new-building-1", "new-building-1"]


def test_posteriors_are_a_distribution_over_the_taught_the_met_and_none() -> None:
    taught, met = np.array([[0.9, 0.1], [0.1, 0.2]], np.float32), np.array([[0.3], [0.3]], np.float32)
    posterior = posteriors(taught, met, NAMES)

    assert posterior.shape == (2, 4)
    np.testing.assert_allclose(posterior.sum(1), 1.0)
    assert posterior.argmax(1).tolist() == [0, 3]


def test_a_crop_shows_the_segment_alone_and_how_large_it_is() -> None:
    image = np.full((240, 320, 3), 200, np.uint8)
    mask = np.zeros((240, 320), np.bool_)
    mask[100:140, 50:130] = True
    near, far = (
        crop(image, np.full((240, 320), depth_m, np.float32), mask, (50, 100, 80, 40), 200.0)
        for depth_m in (10.0, 40.0)
    )

    assert near.shape == (5, SIDE_PX, SIDE_PX)
    assert near[3, SIDE_PX // 2, SIDE_PX // 2] == 1.0
    assert not near[:4, :8].any()
    assert near[0, SIDE_PX // 2, SIDE_PX // 2] == pytest.approx(200 / 64 - 2)
    assert near[4, 0, 0] < far[4, 0, 0]


def test_the_committed_names_are_those_of_the_catalogue_and_know_their_sizes() -> None:
    recogniser = load()
    for kind in CATALOGUE:
        longer, shorter = sorted((kind.width_m, kind.depth_m), reverse=True)
        assert recogniser.sizes_m[kind.name] == pytest.approx((longer, shorter, kind.height_m))


def test_weights_without_their_names_are_refused_with_the_remedy(tmp_path: Path) -> None:
    alone = tmp_path / "objects.onnx"
    alone.write_bytes(WEIGHTS.read_bytes())

    with pytest.raises(ConfigError, match=r"objects\.json.*services\.epam\.train objects"):
        load(alone)
    with pytest.raises(ConfigError, match=r"no weights .*nowhere\.onnx"):
        load(tmp_path / "nowhere.onnx")


def test_weights_of_another_shape_are_refused_by_what_they_give(tmp_path: Path) -> None:
    other = WEIGHTS.with_name("road.onnx")

    with pytest.raises(ConfigError, match=r"road\.onnx"):
        Network(other, TAKES, GIVES)
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"no network")
    with pytest.raises(ConfigError, match=r"broken\.onnx"):
        Network(broken, TAKES, GIVES)
