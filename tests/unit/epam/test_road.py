"""The road and its boundary, in metres; and what is no road."""

from __future__ import annotations

from dataclasses import dataclass
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
from cogmap.errors import ConfigError, UsageError
from schemas.sensing import Calibration
from services.epam.layout.ground import CELL_M, MAX_RANGE_M, project
from services.epam.layout.ground_plane import fit
from services.epam.layout.road import DEFAULT_PATH, INPUT_SHAPE, OUTPUT_SHAPES, RoadSegmenter, load
from services.epam.network import Network
from services.sensory.disparity import DepthFromStereo
from services.sensory.rectify import rectification
from tests.support.world.blocks import CAMERA, Block, painted
from training.photographs import camvid_iou
from training.rendering.towns import render_town

HALF_M = 4.0
# Of towns, from 1001 on for training and from 2001 for validation, nobody trains on this one.
SEED = 4001
VIEWS = 6
FOCAL_BASELINE = CAMERA.fx_px * CAMERA.baseline_m
SIZE = (240, 320)
HORIZON = 121
ROAD = 3
OTHER = 4
VOID = 11


@dataclass(frozen=True, eq=False)
class Street:
    """A straight street, HALF_M to both sides: which pixels show it, and true depth."""

    mask: np.ndarray
    depth_m: np.ndarray


def _street(*blocks: Block, height_m: float = CAMERA.mount_height_m) -> Street:
    _, painted_m, label = painted(list(blocks))
    on_ground = label == 0
    lower = np.float32(height_m / CAMERA.mount_height_m)
    depth_m = np.where(on_ground, painted_m * lower, painted_m)

    rows, _ = np.indices(SIZE)
    below_horizon = (rows > CAMERA.cy_px) & (depth_m > 0)
    in_street = np.abs(_left_m(depth_m)) < HALF_M
    return Street(in_street & on_ground & below_horizon, depth_m)


def _projected(street: Street, depth_m: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    likelihood = street.mask.astype(np.float32)
    return project(likelihood, street.depth_m if depth_m is None else depth_m, CAMERA)


@pytest.fixture(scope="module")
def segmenter() -> RoadSegmenter:
    return load()


def _edge_errors_m(boundary_m: np.ndarray) -> np.ndarray:
    """How far points of the boundary are from the two sides of the street."""
    aside_m = np.abs(boundary_m[:, 1])
    return np.abs(aside_m - HALF_M)


def test_a_straight_street_ends_at_its_two_sides_and_nowhere_else() -> None:
    road_m, boundary_m = _projected(_street())
    errors_m = _edge_errors_m(boundary_m)
    assert len(boundary_m) > 30
    assert np.quantile(errors_m, 0.9) < 0.1

    ahead_m, left_m = road_m.T
    assert (np.abs(left_m) < HALF_M).all()
    assert ahead_m.min() < 4.0
    assert ahead_m.max() > 14.0


def test_road_and_boundary_are_float32_with_one_point_a_cell_in_range() -> None:
    for points in _projected(_street()):
        assert points.dtype == np.float32
        assert np.hypot(*points.T).max() <= MAX_RANGE_M

        cells = np.floor(points / CELL_M)
        assert len(np.unique(cells, axis=0)) == len(cells)


def test_the_boundary_is_located_between_pixels() -> None:
    mask = np.zeros(SIZE, np.float32)
    mask[200:] = 1.0
    mask[199] = 0.4
    row = 199 + (0.5 - 0.4) / (1.0 - 0.4)
    depth_m = CAMERA.mount_height_m * CAMERA.fy_px / (row - CAMERA.cy_px)

    _, boundary_m = project(mask, _street().depth_m, CAMERA)

    expected_m = depth_m + CAMERA.mount_forward_m
    np.testing.assert_allclose(boundary_m[:, 0], expected_m, atol=0.01)


def test_the_ground_follows_depth_where_the_mounts_height_is_wrong() -> None:
    low = _street(height_m=1.4)
    _, boundary_m = _projected(low)

    assert np.median(_edge_errors_m(boundary_m)) < 0.05


def test_wrong_disparities_on_a_third_of_the_road_do_not_move_the_plane() -> None:
    street = _street()
    true_px = np.zeros(SIZE)
    np.divide(FOCAL_BASELINE, street.depth_m, out=true_px, where=street.depth_m > 0)

    rng = np.random.default_rng(1)
    is_wrong = rng.random(SIZE) < 0.3
    disparity_px = np.where(is_wrong, rng.uniform(1, 60, SIZE), true_px)
    plane = fit(street.mask, disparity_px, CAMERA)

    rows, columns = np.nonzero(street.mask)
    error_px = plane.disparity_px(rows, columns, CAMERA) - true_px[rows, columns]
    assert np.abs(error_px).max() < 0.5


def test_without_any_depth_the_camera_is_level_at_its_mount() -> None:
    street = _street()
    unknown = np.zeros_like(street.depth_m)
    _, boundary_m = _projected(street, unknown)

    assert np.quantile(_edge_errors_m(boundary_m), 0.9) < 0.1


def test_no_boundary_is_claimed_behind_something_upright() -> None:
    block = Block(9.0, 0.0, 0.0, (2.0, 2.0), 1.5, (200, 30, 30))
    street = _street(block)
    _, boundary_m = _projected(street)

    assert len(boundary_m) > 20
    assert (np.abs(boundary_m[:, 1]) > HALF_M - 0.4).all()


def test_no_boundary_is_claimed_where_the_image_ends() -> None:
    everywhere = np.ones(SIZE, np.float32)
    everywhere[:HORIZON] = 0.0

    road_m, boundary_m = project(everywhere, _street().depth_m, CAMERA)

    assert len(road_m) > 100
    assert boundary_m.shape == (0, 2)


def test_no_boundary_is_claimed_at_the_outermost_pixels() -> None:
    almost = np.zeros(SIZE, np.float32)
    almost[HORIZON:-2, 2:-2] = 1.0
    _, boundary_m = project(almost, _street().depth_m, CAMERA)

    assert boundary_m.shape == (0, 2)


def test_left_is_positive() -> None:
    street = _street()
    left_half = street.mask & (np.arange(320) < 160)
    likelihood = left_half.astype(np.float32)

    road_m, _ = project(likelihood, street.depth_m, CAMERA)
    left_m = road_m[:, 1]

    assert (left_m > -0.1).all()
    assert left_m.max() > 3.0


def _left_m(depth_m: np.ndarray) -> np.ndarray:
    """How far to the left of the camera each pixel of a depth image is."""
    _, columns = np.indices(SIZE)
    return (CAMERA.cx_px - columns) / CAMERA.fx_px * depth_m


def test_what_stands_on_the_road_is_no_road_though_it_is_in_the_mask() -> None:
    block = Block(8.0, 0.0, 0.0, (2.0, 3.0), 1.2, (90, 90, 90))
    street = _street(block)
    rows, _ = np.indices(SIZE)
    in_street = np.abs(_left_m(street.depth_m)) < HALF_M
    everything = (rows > CAMERA.cy_px) & in_street

    road_m, _ = project(everything.astype(np.float32), street.depth_m, CAMERA)

    ahead_m, left_m = road_m.T
    behind = (np.abs(left_m) < 1.0) & (ahead_m > 9.0)
    assert len(road_m) > 100
    assert not behind.any()


def test_no_road_in_the_image_is_no_road_on_the_ground() -> None:
    nowhere = np.zeros(SIZE, np.float32)

    for points in project(nowhere, _street().depth_m, CAMERA):
        assert points.shape == (0, 2)
        assert points.dtype == np.float32


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


@pytest.mark.parametrize("content", [None, b"no network"], ids=["missing", "broken"])
def test_unusable_weights_are_named_with_the_remedy(tmp_path: Path, content: bytes | None) -> None:
    weights = tmp_path / "mine.onnx"
    if content is not None:
        weights.write_bytes(content)

    with pytest.raises(ConfigError, match=r"mine\.onnx.*cogmap train"):
        load(weights)


def test_weights_of_other_shapes_are_named_with_the_remedy() -> None:
    one_channel_more = {"road": (1, 2, *OUTPUT_SHAPES["road"][2:])}
    with pytest.raises(ConfigError, match=r"road\.onnx.*cogmap train"):
        Network(DEFAULT_PATH, INPUT_SHAPE, one_channel_more)

    colour_alone = (1, 3, *INPUT_SHAPE[2:])
    with pytest.raises(ConfigError, match=r"road\.onnx.*cogmap train"):
        Network(DEFAULT_PATH, colour_alone, OUTPUT_SHAPES)


def _photographs(folder: Path, segmenter: RoadSegmenter) -> tuple[Path, Path]:
    """Two images with labels that say what the network finds in one, and in the other that nothing
    is known.
    """
    images = folder / "images"
    labels = folder / "labels"
    images.mkdir()
    labels.mkdir()

    block = Block(20.0, 9.0, 0.2, (8.0, 8.0), 6.0, (180, 60, 50))
    known, _, _ = painted([block], seed=0)
    label = np.where(segmenter.mask(known), ROAD, OTHER)
    unknown, _, _ = painted([block], seed=1)
    void = np.full(SIZE, VOID)

    for number, (image, shown) in enumerate([(known, label), (unknown, void)]):
        cv2.imwrite(str(images / f"{number}.png"), image[..., ::-1])
        cv2.imwrite(str(labels / f"{number}.png"), shown.astype(np.uint8))
    return images, labels


def test_iou_on_photographs_counts_what_is_labelled_and_nothing_else(
    segmenter: RoadSegmenter, tmp_path: Path
) -> None:
    images, labels = _photographs(tmp_path, segmenter)
    assert camvid_iou(DEFAULT_PATH, images, labels) == 1.0

    path = str(labels / "0.png")
    label = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    was_road = label == ROAD
    assert was_road.any()

    rows = np.flatnonzero(was_road.any(axis=1))
    lower = slice(rows[len(rows) // 2], None)
    label[lower][was_road[lower]] = OTHER
    cv2.imwrite(path, label)

    share = (label == ROAD).sum() / was_road.sum()
    assert camvid_iou(DEFAULT_PATH, images, labels) == pytest.approx(share)


def _without_a_label(images: Path, labels: Path) -> None:
    (labels / "1.png").unlink()


def _label_of_another_size(images: Path, labels: Path) -> None:
    cv2.imwrite(str(labels / "1.png"), np.zeros((8, 8), np.uint8))


def _label_in_colour(images: Path, labels: Path) -> None:
    cv2.imwrite(str(labels / "1.png"), np.zeros((240, 320, 3), np.uint8))


def _no_image(images: Path, labels: Path) -> None:
    (images / "1.png").write_text("no image")


def _an_empty_file(images: Path, labels: Path) -> None:
    (labels / "1.png").write_bytes(b"")


def _no_images(images: Path, labels: Path) -> None:
    for path in images.glob("*.png"):
        path.unlink()


def _no_folder(images: Path, labels: Path) -> None:
    labels.rename(labels.with_name("elsewhere"))


def _no_road(images: Path, labels: Path) -> None:
    (images / "0.png").unlink()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (_without_a_label, r"1\.png has no label .*labels/1\.png: add it"),
        (_label_of_another_size, r"labels/1\.png is uint8 \(8, 8\), where uint8 \(240, 320\) fits"),
        (
            _label_in_colour,
            r"labels/1\.png is uint8 \(240, 320, 3\), where uint8 \(240, 320\) fits",
        ),
        (_no_image, r"images/1\.png is no image"),
        (_an_empty_file, r"labels/1\.png is no image"),
        (_no_images, r"no \*\.png in .*images"),
        (_no_folder, r"no folder .*labels"),
        (_no_road, r"no pixel in .*labels is labelled 3"),
    ],
)
def test_photographs_that_cannot_be_used_are_named_with_the_remedy(
    segmenter: RoadSegmenter, tmp_path: Path, spoil: object, said: str
) -> None:
    images, labels = _photographs(tmp_path, segmenter)
    spoil(images, labels)  # type: ignore[operator]

    with pytest.raises(UsageError, match=said):
        camvid_iou(DEFAULT_PATH, images, labels)
