"""Naming segments by what they look like: what was taught, what was met once, and what is new."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import ConfigError
from services.epam.network import Network
from services.epam.recognition.objects import DEFAULT_PATH as WEIGHTS
from services.epam.recognition.objects import (
    DIMENSIONS,
    INPUT_SHAPE,
    MAX_APPEARANCES,
    OUTPUT_SHAPES,
    Appearance,
    ObjectRecognizer,
    Prototypes,
    load,
    posteriors,
)
from services.sim.layout.catalogue import CATALOGUE


def _direction(number: int, towards: int = 0, share: float = 0.0) -> np.ndarray:
    """The unit vector along axis `number`, turned a little towards another."""
    vector = np.zeros(DIMENSIONS, np.float32)
    vector[number] += 1 - share
    vector[towards] += share
    return vector / np.linalg.norm(vector)


NAMES = Prototypes(
    names=["bakery", "bank"],
    directions=[_direction(0).tolist(), _direction(1).tolist()],
    size_m=[(9.0, 8.0, 6.0), (11.0, 9.0, 10.0)],
    sharpness=20.0,
    unknown=0.5,
    novel_sharpness=20.0,
    novel_unknown=0.4,
    evidence=1.0,
)


def _look(
    number: int, towards: int = 0, share: float = 0.0, *, building: float = 1.0
) -> Appearance:
    return Appearance(_direction(number, towards, share), building, 1.0)


@pytest.fixture
def recogniser() -> ObjectRecognizer:
    return ObjectRecognizer(Network(WEIGHTS, INPUT_SHAPE, OUTPUT_SHAPES), NAMES)


def test_what_was_taught_has_its_name_its_size_and_a_high_activation(
    recogniser: ObjectRecognizer,
) -> None:
    found = recogniser.recognize(_look(1, 2, 0.1))

    assert (found.label, found.size_m) == ("bank", (11.0, 9.0, 10.0))
    assert found.activation > 0.95


def test_what_is_like_nothing_has_no_label_and_is_known_once_it_was_learned(
    recogniser: ObjectRecognizer,
) -> None:
    stranger = _look(5)
    before = recogniser.recognize(stranger)
    recogniser.learn("new-building-1", stranger.embedding)
    after = recogniser.recognize(_look(5, 6, 0.25))

    assert (before.known, before.size_m) == (False, None)
    assert before.unknown > 0.9
    assert (after.label, after.size_m) == ("new-building-1", None)
    assert after.activation > 0.9
    assert not recogniser.recognize(_look(9)).known


def test_what_stands_elsewhere_is_not_considered(recogniser: ObjectRecognizer) -> None:
    found = recogniser.recognize(_look(1, 0, 0.35))
    other = recogniser.recognize(_look(1, 0, 0.35), {"bank"})

    assert (found.label, other.label) == ("bank", "bakery")
    assert other.activation > found.unknown


def test_what_is_hardly_a_building_is_nothing_known_and_no_new_building_either(
    recogniser: ObjectRecognizer,
) -> None:
    for number in (1, 5):
        found = recogniser.recognize(_look(number, building=0.1))
        assert not found.known
        assert found.background == pytest.approx(0.9)
        assert found.unknown < 0.1


def test_an_object_is_as_like_as_the_look_of_it_that_is_most_alike(
    recogniser: ObjectRecognizer,
) -> None:
    recogniser.learn("new-building-1", _direction(5))
    before = recogniser.recognize(_look(6))
    recogniser.learn("new-building-1", _direction(6))
    after = recogniser.recognize(_look(6))

    assert not before.known
    assert after.label == "new-building-1"
    assert after.activation == recogniser.recognize(_look(5)).activation
    assert [label for label, _ in recogniser.learned] == ["new-building-1", "new-building-1"]


def test_another_look_is_one_unlike_all_that_were_learned_until_there_are_enough(
    recogniser: ObjectRecognizer,
) -> None:
    recogniser.learn("new-building-1", _direction(5))
    alike, other = (recogniser.recognize(_look(5, 6, share)) for share in (0.1, 0.35))
    taught = recogniser.recognize(_look(1, 2, 0.3))

    assert other.label == "new-building-1"
    assert [recogniser.is_new_appearance(one) for one in (alike, other, taught)] == [
        False,
        True,
        False,
    ]
    for number in range(MAX_APPEARANCES - 1):
        recogniser.learn("new-building-1", _direction(10 + number))
    assert not recogniser.is_new_appearance(other)


def test_posteriors_are_a_distribution_over_the_taught_the_met_another_building_and_none() -> None:
    taught = np.array([[0.9, 0.1], [0.1, 0.2]] * 2, np.float32)
    met = np.full((4, 1), 0.2, np.float32)
    posterior = posteriors(taught, met, np.array([1.0, 0.9, 0.2, 0.0]), NAMES)

    assert posterior.shape == (4, 5)
    np.testing.assert_allclose(posterior.sum(1), 1.0)
    assert posterior.argmax(1).tolist() == [0, 3, 4, 4]


def test_the_committed_names_are_those_of_the_catalogue_and_know_their_sizes() -> None:
    recogniser = load()
    for kind in CATALOGUE:
        longer, shorter = sorted((kind.width_m, kind.depth_m), reverse=True)
        assert recogniser.sizes_m[kind.name] == pytest.approx((longer, shorter, kind.height_m))


def test_weights_without_their_names_are_refused_with_the_remedy(tmp_path: Path) -> None:
    alone = tmp_path / "objects.onnx"
    alone.write_bytes(WEIGHTS.read_bytes())

    with pytest.raises(ConfigError, match=r"objects\.json.*cogmap train objects"):
        load(alone)
    with pytest.raises(ConfigError, match=r"no weights .*nowhere\.onnx"):
        load(tmp_path / "nowhere.onnx")


def test_weights_of_another_shape_are_refused_by_what_they_give(tmp_path: Path) -> None:
    other = WEIGHTS.with_name("road.onnx")

    with pytest.raises(ConfigError, match=r"road\.onnx"):
        Network(other, INPUT_SHAPE, OUTPUT_SHAPES)
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"no network")
    with pytest.raises(ConfigError, match=r"broken\.onnx"):
        Network(broken, INPUT_SHAPE, OUTPUT_SHAPES)
