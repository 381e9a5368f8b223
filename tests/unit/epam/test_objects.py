"""Segments recognized by their embeddings: taught labels, unknown buildings and background."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import ConfigError
from cogmap.files.digests import write_digests
from cogmap.services.epam.network import Network
from cogmap.services.epam.recognition.objects import DEFAULT_PATH as WEIGHTS
from cogmap.services.epam.recognition.objects import (
    DIMENSIONS,
    INPUT_SHAPE,
    OUTPUT_SHAPES,
    Appearance,
    ObjectRecognizer,
    Prototypes,
    load,
    posteriors,
)
from cogmap.services.sim.layout.catalogue import CATALOGUE


def _direction(number: int, towards: int = 0, share: float = 0.0) -> np.ndarray:
    """The unit vector along axis `number`, turned a little towards another."""
    vector = np.zeros(DIMENSIONS, np.float32)
    vector[number] += 1 - share
    vector[towards] += share
    return vector / np.linalg.norm(vector)


PROTOTYPES = Prototypes(
    names=["bakery", "bank"],
    directions=[_direction(0).tolist(), _direction(1).tolist()],
    size_m=[(9.0, 8.0, 6.0), (11.0, 9.0, 10.0)],
    sharpness=20.0,
    unknown=0.5,
    novel_sharpness=20.0,
    novel_unknown=0.4,
    evidence=1.0,
    taught_share=0.5,
)


def _appearance(
    number: int, towards: int = 0, share: float = 0.0, *, building: float = 1.0
) -> Appearance:
    return Appearance(_direction(number, towards, share), building, 1.0)


@pytest.fixture
def recognizer() -> ObjectRecognizer:
    return ObjectRecognizer(Network(WEIGHTS, INPUT_SHAPE, OUTPUT_SHAPES), PROTOTYPES)


def test_a_taught_object_has_its_label_its_size_and_a_high_activation(
    recognizer: ObjectRecognizer,
) -> None:
    found = recognizer.recognize(_appearance(1, 2, 0.1))

    assert (found.label, found.size_m) == ("bank", (11.0, 9.0, 10.0))
    assert found.activation > 0.95


def test_a_building_that_was_not_taught_is_unknown_and_has_no_size(
    recognizer: ObjectRecognizer,
) -> None:
    found = recognizer.recognize(_appearance(5))

    assert not found.known
    assert found.size_m is None
    assert found.unknown > 0.9


def test_what_looks_like_a_taught_object_is_one_less_often_among_strangers(
    recognizer: ObjectRecognizer,
) -> None:
    look = _appearance(1, 5, 0.45)
    calibrated = recognizer.recognize(look)
    among_strangers = recognizer.recognize(look, log_taught=-4.0)

    ratio = np.exp(-4.0)
    odds = calibrated.evidence / calibrated.unknown
    assert calibrated.known
    assert among_strangers.evidence / among_strangers.unknown == pytest.approx(ratio * odds)
    assert among_strangers.activation == among_strangers.evidence < calibrated.evidence


def test_the_names_of_a_building_are_as_likely_as_it_looks_like_each(
    recognizer: ObjectRecognizer,
) -> None:
    between = recognizer.recognize(_appearance(1, 0, 0.45))

    assert (between.label, list(between.names)) == ("bank", ["bakery", "bank"])
    assert between.evidence == between.names["bank"] > between.names["bakery"] > 0.01
    assert sum(between.names.values()) <= 1.0


def test_an_appearance_is_published_with_how_it_is_to_be_compared(
    recognizer: ObjectRecognizer,
) -> None:
    published = recognizer.published(_appearance(5))

    np.testing.assert_array_equal(published.direction.numpy(), _direction(5))
    assert (published.sharpness, published.even_cosine) == (20.0, 0.4)


def test_background_is_neither_a_known_nor_an_unknown_building(
    recognizer: ObjectRecognizer,
) -> None:
    for number in (1, 5):
        found = recognizer.recognize(_appearance(number, building=0.1))

        assert not found.known
        assert found.background == pytest.approx(0.9)
        assert found.unknown < 0.1


def test_posteriors_sum_to_1_over_labels_unknown_building_and_background() -> None:
    taught = np.array([[0.9, 0.1], [0.1, 0.2]] * 2, np.float32)
    novel = np.full((4, 1), 0.2, np.float32)
    building = np.array([1.0, 0.9, 0.2, 0.0])
    posterior = posteriors(taught, novel, building, PROTOTYPES)
    sums = posterior.sum(axis=1)

    assert posterior.shape == (4, 5)
    np.testing.assert_allclose(sums, 1.0)
    assert posterior.argmax(axis=1).tolist() == [0, 3, 4, 4]


def test_the_committed_prototypes_have_the_catalogues_names_and_sizes() -> None:
    recognizer = load()
    for kind in CATALOGUE:
        longer_m, shorter_m = sorted((kind.width_m, kind.depth_m), reverse=True)
        expected_m = (longer_m, shorter_m, kind.height_m)
        assert recognizer.sizes_m[kind.name] == pytest.approx(expected_m)


def test_weights_without_their_prototypes_are_refused_with_the_remedy(tmp_path: Path) -> None:
    alone = tmp_path / "objects.onnx"
    alone.write_bytes(WEIGHTS.read_bytes())
    write_digests(alone)

    with pytest.raises(ConfigError, match=r"no weights .*objects\.json: .*cogmap train"):
        load(alone)
    with pytest.raises(ConfigError, match=r"no weights .*nowhere\.onnx"):
        load(tmp_path / "nowhere.onnx")


def test_weights_of_another_shape_are_refused(tmp_path: Path) -> None:
    other = WEIGHTS.with_name("road.onnx")

    with pytest.raises(ConfigError, match=r"road\.onnx"):
        Network(other, INPUT_SHAPE, OUTPUT_SHAPES)

    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"no network")
    write_digests(broken)
    with pytest.raises(ConfigError, match=r"broken\.onnx does not hold a network"):
        Network(broken, INPUT_SHAPE, OUTPUT_SHAPES)
