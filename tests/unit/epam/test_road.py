"""The network that finds the road in images, and weights that it cannot use."""

from __future__ import annotations

from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from benchmarks.perception.road import (
    road_edge_error_m,
    road_edge_errors_m,
    road_edges_missed_m,
    road_iou,
)
from cogmap.errors import ConfigError
from cogmap.files.digests import write_digests
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.layout.ground import project
from cogmap.services.epam.layout.road import (
    DEFAULT_PATH,
    INPUT_SHAPE,
    OUTPUT_SHAPES,
    RoadSegmenter,
    load,
)
from cogmap.services.epam.network import Network
from cogmap.services.sensory.disparity import DepthFromStereo
from cogmap.services.sensory.rectify import rectification
from cogmap.training.rendering.towns import render_town
from tests.support.world.blocks import painted

# Of towns, from 1001 on for training and from 2001 for validation, nobody trains on this one.
SEED = 4001
VIEWS = 6
SIZE = (240, 320)


@pytest.fixture(scope="module")
def segmenter() -> RoadSegmenter:
    return load()


@pytest.mark.parametrize("level", [0, 3, 90, 255])
def test_an_image_without_contrast_shows_no_road(segmenter: RoadSegmenter, level: int) -> None:
    flat = np.full((*SIZE, 3), level, np.uint8)
    mask = segmenter.mask(flat)

    assert not mask.any()


def test_a_black_image_with_the_noise_of_a_camera_shows_no_road(segmenter: RoadSegmenter) -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(0, 3, (*SIZE, 3))
    black = np.clip(noise, 0, 255).astype(np.uint8)

    assert not segmenter.mask(black).any()


@pytest.mark.parametrize("size", [(240, 320), (360, 480), (121, 97)])
def test_an_image_of_any_size_gets_a_mask_of_its_size_and_the_same_one_twice(
    segmenter: RoadSegmenter, size: tuple[int, int]
) -> None:
    street, _, _ = painted([])
    image = cv2.resize(street, size[::-1]).astype(np.uint8)
    mask = segmenter.mask(image)
    again = segmenter.mask(image)

    assert mask.shape == size
    assert mask.dtype == np.bool_
    np.testing.assert_array_equal(mask, again)


def test_road_in_a_town_never_seen_is_found_and_its_ends_are_placed(
    segmenter: RoadSegmenter,
) -> None:
    views = render_town(SEED, VIEWS)
    calibration = msgspec.json.decode(views["calibration"].tobytes(), type=Calibration)
    rectified = rectification(calibration)
    camera = rectified.calibration
    matcher = DepthFromStereo(camera, 2.5)

    masks = []
    errors_m = []
    missed_m = []
    columns = [views[key] for key in ("left", "right", "surface", "depth_m")]
    for left, right, surface, true_m in zip(*columns, strict=True):
        image, other = rectified.apply(left, right)
        likelihood = segmenter.likelihood(image)
        masks.append(likelihood >= 0.5)

        _, boundary_m = project(likelihood, matcher.depth_m(image, other), camera)
        errors_m.append(road_edge_errors_m(boundary_m, surface, true_m, camera))
        missed_m.append(road_edges_missed_m(boundary_m, surface, true_m, camera))

    surfaces = np.asarray(views["surface"], np.uint8)
    assert road_iou(np.array(masks), surfaces) > 0.9
    assert road_edge_error_m(errors_m) < 0.25
    assert road_edge_error_m(missed_m) < 0.5


def test_passes_of_a_network_that_run_beside_one_another_have_the_outputs_of_single_ones() -> None:
    network = Network(DEFAULT_PATH, INPUT_SHAPE, OUTPUT_SHAPES)
    rng = np.random.default_rng(6)
    images = rng.normal(size=(4, *INPUT_SHAPE)).astype(np.float32)

    begun = [network.begin(image) for image in images]
    alone = [network(image) for image in images]

    for beside, (expected,) in zip(begun, alone, strict=True):
        (output,) = beside.result()
        assert (output == expected).all()


@pytest.mark.parametrize("content", [None, b"no network"], ids=["missing", "broken"])
def test_unusable_weights_are_named_with_the_remedy(tmp_path: Path, content: bytes | None) -> None:
    weights = tmp_path / "mine.onnx"
    if content is not None:
        weights.write_bytes(content)
        write_digests(weights)

    with pytest.raises(ConfigError, match=r"mine\.onnx.*cogmap train"):
        load(weights)


def test_weights_of_other_shapes_are_named_with_the_remedy() -> None:
    one_channel_more = {"road": (1, 2, *OUTPUT_SHAPES["road"][2:])}
    with pytest.raises(ConfigError, match=r"road\.onnx.*cogmap train"):
        Network(DEFAULT_PATH, INPUT_SHAPE, one_channel_more)

    colour_alone = (1, 3, *INPUT_SHAPE[2:])
    with pytest.raises(ConfigError, match=r"road\.onnx.*cogmap train"):
        Network(DEFAULT_PATH, colour_alone, OUTPUT_SHAPES)
