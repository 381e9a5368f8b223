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
from tests.support.blocks import CAMERA, Block, painted
from training.photographs import camvid_iou
from training.rendering.towns import render_town

HALF_M = 4.0
# Of towns, from 1001 on for training and from 2001 for validation, nobody trains on this one.
SEED = 4001
VIEWS = 6
FOCAL_BASELINE = CAMERA.fx_px * CAMERA.baseline_m


@dataclass(frozen=True, eq=False)
class Street:
    """A straight street, HALF_M to both sides: which pixels show it, and true depth."""

    mask: np.ndarray
    depth_m: np.ndarray


def _street(*blocks: Block, height_m: float = CAMERA.mount_height_m) -> Street:
    _, depth_m, label = painted(list(blocks))
    rows, columns = np.indices(depth_m.shape)
    depth_m = np.where(label > 0, depth_m, depth_m * np.float32(height_m / CAMERA.mount_height_m))
    left_m = (CAMERA.cx_px - columns) / CAMERA.fx_px * depth_m
    ground = (rows > CAMERA.cy_px) & (label == 0) & (depth_m > 0)
    return Street((np.abs(left_m) < HALF_M) & ground, depth_m)


def _projected(street: Street, depth_m: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    return project(
        street.mask.astype(np.float32), street.depth_m if depth_m is None else depth_m, CAMERA
    )


@pytest.fixture(scope="module")
def segmenter() -> RoadSegmenter:
    return load()


def test_a_straight_street_ends_at_its_two_sides_and_nowhere_else() -> None:
    road_m, boundary_m = _projected(_street())

    assert len(boundary_m) > 30
    assert np.quantile(np.abs(np.abs(boundary_m[:, 1]) - HALF_M), 0.9) < 0.1
    assert (np.abs(road_m[:, 1]) < HALF_M).all()
    assert road_m[:, 0].min() < 4.0
    assert road_m[:, 0].max() > 14.0


def test_road_and_boundary_are_float32_with_one_point_a_cell_in_range() -> None:
    for points in _projected(_street()):
        assert points.dtype == np.float32
        assert np.hypot(*points.T).max() <= MAX_RANGE_M

        cells = np.floor(points / CELL_M)
        assert len(np.unique(cells, axis=0)) == len(cells)


def test_the_boundary_is_located_between_pixels() -> None:
    mask = np.zeros((240, 320), np.float32)
    mask[200:] = 1.0
    mask[199] = 0.4
    _, boundary_m = project(mask, _street().depth_m, CAMERA)
    row = 199 + (0.5 - 0.4) / (1.0 - 0.4)
    expected_m = (
        CAMERA.mount_height_m * CAMERA.fy_px / (row - CAMERA.cy_px) + CAMERA.mount_forward_m
    )

    np.testing.assert_allclose(boundary_m[:, 0], expected_m, atol=0.01)


def test_the_ground_follows_depth_where_the_mounts_height_is_wrong() -> None:
    low = _street(height_m=1.4)
    _, boundary_m = _projected(low)

    assert np.median(np.abs(np.abs(boundary_m[:, 1]) - HALF_M)) < 0.05


def test_wrong_disparities_on_a_third_of_the_road_do_not_move_the_plane() -> None:
    street = _street()
    rng = np.random.default_rng(1)
    true_px = np.divide(
        FOCAL_BASELINE, street.depth_m, out=np.zeros((240, 320)), where=street.depth_m > 0
    )
    wrong = rng.random(true_px.shape) < 0.3
    plane = fit(street.mask, np.where(wrong, rng.uniform(1, 60, true_px.shape), true_px), CAMERA)
    rows, columns = np.nonzero(street.mask)
    error_px = plane.disparity_px(rows, columns, CAMERA) - true_px[rows, columns]

    assert np.abs(error_px).max() < 0.5


def test_without_any_depth_the_camera_is_level_at_its_mount() -> None:
    street = _street()
    _, boundary_m = _projected(street, np.zeros_like(street.depth_m))

    assert np.quantile(np.abs(np.abs(boundary_m[:, 1]) - HALF_M), 0.9) < 0.1


def test_no_boundary_is_claimed_behind_something_upright() -> None:
    block = Block(9.0, 0.0, 0.0, (2.0, 2.0), 1.5, (200, 30, 30))
    _, boundary_m = _projected(_street(block))

    assert len(boundary_m) > 20
    assert (np.abs(boundary_m[:, 1]) > HALF_M - 0.4).all()


def test_no_boundary_is_claimed_where_the_image_ends() -> None:
    everywhere = np.ones((240, 320), np.float32)
    everywhere[:121] = 0.0
    road_m, boundary_m = project(everywhere, _street().depth_m, CAMERA)

    assert len(road_m) > 100
    assert boundary_m.shape == (0, 2)


def test_no_boundary_is_claimed_at_the_outermost_pixels() -> None:
    almost = np.ones((240, 320), np.float32)
    almost[:121] = 0.0
    almost[:, :2] = almost[:, -2:] = almost[-2:] = 0.0

    assert project(almost, _street().depth_m, CAMERA)[1].shape == (0, 2)


def test_left_is_positive() -> None:
    street = _street()
    left_half = street.mask & (np.arange(320) < 160)
    road_m, _ = project(left_half.astype(np.float32), street.depth_m, CAMERA)

    assert (road_m[:, 1] > -0.1).all()
    assert road_m[:, 1].max() > 3.0


def test_what_stands_on_the_road_is_no_road_though_it_is_in_the_mask() -> None:
    block = Block(8.0, 0.0, 0.0, (2.0, 3.0), 1.2, (90, 90, 90))
    street = _street(block)
    rows, columns = np.indices(street.depth_m.shape)
    across_m = (CAMERA.cx_px - columns) / CAMERA.fx_px * street.depth_m
    everything = ((rows > CAMERA.cy_px) & (np.abs(across_m) < HALF_M)).astype(np.float32)
    road_m, _ = project(everything, street.depth_m, CAMERA)
    behind = (np.abs(road_m[:, 1]) < 1.0) & (road_m[:, 0] > 9.0)

    assert len(road_m) > 100
    assert not behind.any()


def test_no_road_in_the_image_is_no_road_on_the_ground() -> None:
    for points in project(np.zeros((240, 320), np.float32), _street().depth_m, CAMERA):
        assert (points.shape, points.dtype) == ((0, 2), np.float32)


@pytest.mark.parametrize("level", [0, 3, 90, 255])
def test_an_image_without_contrast_shows_no_road(segmenter: RoadSegmenter, level: int) -> None:
    assert not segmenter.mask(np.full((240, 320, 3), level, np.uint8)).any()


def test_a_black_image_with_the_noise_of_a_camera_shows_no_road(segmenter: RoadSegmenter) -> None:
    noise = np.random.default_rng(0).normal(0, 3, (240, 320, 3))

    assert not segmenter.mask(np.clip(noise, 0, 255).astype(np.uint8)).any()


@pytest.mark.parametrize("size", [(240, 320), (360, 480), (121, 97)])
def test_an_image_of_any_size_gets_a_mask_of_its_size_and_the_same_one_twice(
    segmenter: RoadSegmenter, size: tuple[int, int]
) -> None:
    image = cv2.resize(painted([])[0], size[::-1]).astype(np.uint8)
    masks = [segmenter.mask(image) for _ in range(2)]

    assert masks[0].shape == size
    assert masks[0].dtype == np.bool_
    np.testing.assert_array_equal(*masks)


def test_road_in_a_town_never_seen_is_found_and_its_ends_are_placed(
    segmenter: RoadSegmenter,
) -> None:
    views = render_town(SEED, VIEWS)
    rectified = rectification(msgspec.json.decode(views["calibration"].tobytes(), type=Calibration))
    matcher = DepthFromStereo(rectified.calibration, 2.5)
    camera = rectified.calibration
    masks = []
    errors_m = []
    missed_m = []
    for left, right, surface, true_m in zip(
        *(views[key] for key in ("left", "right", "surface", "depth_m")), strict=True
    ):
        image, other = rectified.apply(left, right)
        likelihood = segmenter.likelihood(image)
        _, boundary_m = project(likelihood, matcher.depth_m(image, other), camera)
        masks.append(likelihood >= 0.5)
        errors_m.append(road_edge_errors_m(boundary_m, surface, true_m, camera))
        missed_m.append(road_edges_missed_m(boundary_m, surface, true_m, camera))

    assert road_iou(np.array(masks), np.asarray(views["surface"], np.uint8)) > 0.9
    assert road_edge_error_m(errors_m) < 0.25
    assert road_edge_error_m(missed_m) < 0.5


def test_unusable_weights_are_named_with_the_remedy(
    tmp_path: Path,
) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.onnx.*cogmap train"):
        load(tmp_path / "nowhere.onnx")

    (tmp_path / "broken.onnx").write_bytes(b"no network")
    with pytest.raises(ConfigError, match=r"broken\.onnx.*cogmap train"):
        load(tmp_path / "broken.onnx")
    with pytest.raises(ConfigError, match=r"road\.onnx.*cogmap train"):
        Network(DEFAULT_PATH, INPUT_SHAPE, {"road": (1, 2, *OUTPUT_SHAPES["road"][2:])})
    with pytest.raises(ConfigError, match=r"road\.onnx.*cogmap train"):
        Network(DEFAULT_PATH, (1, 3, *INPUT_SHAPE[2:]), OUTPUT_SHAPES)


def _photographs(folder: Path, segmenter: RoadSegmenter) -> tuple[Path, Path]:
    """Two images with labels that say what the network finds in one, and in the other that nothing
    is known.
    """
    images = folder / "images"
    labels = folder / "labels"
    images.mkdir()
    labels.mkdir()
    for number in range(2):
        image = painted([Block(20.0, 9.0, 0.2, (8.0, 8.0), 6.0, (180, 60, 50))], seed=number)[0]
        label = (
            np.where(segmenter.mask(image), 3, 4) if number == 0 else np.full(image.shape[:2], 11)
        )
        cv2.imwrite(str(images / f"{number}.png"), image[..., ::-1])
        cv2.imwrite(str(labels / f"{number}.png"), label.astype(np.uint8))
    return images, labels


def test_iou_on_photographs_counts_what_is_labelled_and_nothing_else(
    segmenter: RoadSegmenter, tmp_path: Path
) -> None:
    images, labels = _photographs(tmp_path, segmenter)
    assert camvid_iou(DEFAULT_PATH, images, labels) == 1.0

    label = cv2.imread(str(labels / "0.png"), cv2.IMREAD_UNCHANGED)
    assert (label == 3).any()

    rows = np.flatnonzero((label == 3).any(1))
    label[rows[len(rows) // 2] :][label[rows[len(rows) // 2] :] == 3] = 4
    share = (label == 3).sum() / (
        cv2.imread(str(labels / "0.png"), cv2.IMREAD_UNCHANGED) == 3
    ).sum()
    cv2.imwrite(str(labels / "0.png"), label)

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
