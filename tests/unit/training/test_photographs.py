"""How much of the road of labelled photographs is found."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from cogmap.errors import UsageError
from cogmap.services.epam.layout.road import DEFAULT_PATH, RoadSegmenter, load
from cogmap.training.photographs import camvid_iou
from tests.support.world.blocks import Block, painted

SIZE = (240, 320)
ROAD = 3
OTHER = 4
VOID = 11


@pytest.fixture(scope="module")
def segmenter() -> RoadSegmenter:
    return load()


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
        (_label_of_another_size, r"labels/1\.png is uint8 \(8, 8\), but its image needs uint8"),
        (
            _label_in_colour,
            r"labels/1\.png is uint8 \(240, 320, 3\), but its image needs uint8",
        ),
        (_no_image, r"images/1\.png is no image"),
        (_an_empty_file, r"labels/1\.png is no image"),
        (_no_images, r"no \*\.png or \*\.jpg in .*images"),
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
