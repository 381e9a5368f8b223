"""What the benchmark of object recognition counts, on views so small that the right answer is
known.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from benchmarks.perception import objects
from benchmarks.perception.objects import Building, Segment, Sight
from benchmarks.perception.towns import THRESHOLDS
from cogmap.schemas.sensing import Percept

TRAINED = frozenset({"bakery", "bank"})
SIZE = (10, 10)
Mask = npt.NDArray[np.bool_]


def _label() -> npt.NDArray[np.uint8]:
    """Building 0 on the left, 20 pixels, building 1 on the right, 10 pixels, of 100."""
    label = np.zeros(SIZE, np.uint8)
    label[_mask(slice(2, 7), slice(0, 4))] = 1
    label[_mask(slice(2, 7), slice(8, 10))] = 2
    return label


def _mask(rows: slice, columns: slice) -> Mask:
    mask = np.zeros(SIZE, bool)
    mask[rows, columns] = True
    return mask


def _segment(
    label: str, building: Building | None, activation: float = 0.9, share: float = 0.1
) -> Segment:
    return Segment(label, activation, share, building, building)


def _kind(building: Building | None) -> str:
    return building.kind if building else ""


def test_the_thresholds_are_those_that_were_promised() -> None:
    written = {name: str(threshold) for name, threshold in THRESHOLDS.items()}

    assert written == {
        "top1": "≥ 0.97",
        "ece": "≤ 0.05",
        "detect_recall": "≥ 0.95",
        "detect_precision": "≥ 0.95",
        "novel_top1": "≥ 0.85",
        "novel_wrong_merges": "≤ 0.02",
        "road_iou": "≥ 0.93",
        "road_edge_error_m": "≤ 0.25",
        "depth_error": "≤ 0.04",
        "sequence_recall_at_99p": "≥ 0.8",
        "frame_ms_p50": "≤ 40",
        "frame_ms_p99": "≤ 60",
    }


def test_an_outline_holds_its_corners_and_what_is_between_them() -> None:
    percept = Percept(
        name="bakery",
        activation=0.9,
        evidence=0.9,
        bearing_rad=0.0,
        range_m=10.0,
        bearing_sd_rad=0.1,
        range_sd_m=1.0,
        width_m=9.0,
        height_m=6.0,
        whole=True,
        box_px=(2, 1, 4, 3),
        outline_px=[(2, 1), (5, 1), (5, 3), (2, 3)],
    )
    filled = objects.filled(percept, SIZE)

    np.testing.assert_array_equal(filled, _mask(slice(1, 4), slice(2, 6)))


def test_a_sight_has_the_buildings_of_its_view() -> None:
    seen = objects.sight([], _label(), ["bakery", "bank"], [10.0, 20.0])
    bakery, bank = seen.buildings

    assert bakery == Building(0, "bakery", 0.2, 10.0)
    assert bank == Building(1, "bank", 0.1, 20.0)


def test_a_claim_matches_the_building_it_half_covers_and_no_other_claim_does() -> None:
    half = ("bank", 0.8, _mask(slice(2, 7), slice(0, 2)))
    whole = ("bakery", 0.9, _mask(slice(2, 7), slice(0, 4)))
    other = ("bank", 0.7, _mask(slice(0, 3), slice(8, 10)))
    seen = objects.sight([half, whole, other], _label(), ["bakery", "bank"], [10.0, 20.0])
    matched = [_kind(segment.building) for segment in seen.segments]
    shown = [_kind(segment.shows) for segment in seen.segments]
    shares = [segment.share for segment in seen.segments]

    assert matched == ["", "bakery", ""]
    assert shown == ["bakery", "bakery", ""]
    assert shares == [0.1, 0.2, 0.06]


def test_a_name_counts_where_a_trained_building_in_range_is_matched() -> None:
    near = Building(0, "bakery", 0.2, 10.0)
    far = Building(1, "bank", 0.1, 70.0)
    unknown = Building(2, "invented", 0.1, 10.0)
    wrong = _segment("bank", near)
    right = _segment("bakery", near)
    too_far = _segment("bakery", far)
    untrained = _segment("bank", unknown)
    sights = [Sight((near,), (wrong,)), Sight((near, far), (right, too_far, untrained))]

    assert objects.named(sights, TRAINED, 5.0, 60.0) == [False, True]


def test_detection_counts_large_buildings_found_and_large_segments_right() -> None:
    large = Building(0, "bakery", 0.2, 10.0)
    small = Building(1, "bank", 0.009, 50.0)
    found = _segment("bakery", large)
    found_small = _segment("bank", small)
    speck = _segment("bank", None, share=0.005)
    miss = _segment("bank", None)
    sights = [Sight((large, small), (found, found_small, speck)), Sight((large,), (miss,))]

    assert objects.detection(sights) == (1, 2, 2, 3)


def _sight(*segments: Segment) -> Sight:
    return Sight((), segments)


def test_a_learned_label_is_right_for_the_building_it_was_given_to() -> None:
    taught = Building(0, "bakery", 0.2, 10.0)
    novel = Building(1, "invented-1", 0.2, 9.0)
    other = Building(2, "invented-2", 0.2, 9.0)
    before = [
        _sight(
            _segment("bakery", taught, 0.9),
            _segment("", novel, 0.8),
            _segment("bank", None, 0.3),
        ),
        _sight(
            _segment("new-1", novel, 0.7),
            _segment("new-1", other, 0.6),
            _segment("", novel, 0.5),
        ),
        _sight(
            _segment("", taught, 0.4),
            _segment("new-1", taught, 0.2),
            _segment("", None, 0.1),
        ),
    ]
    after = [_sight(_segment("bakery", taught), _segment("new-1", novel)), _sight(), _sight()]

    assert objects.right_or_not(before, after, TRAINED) == [
        (0.9, True),
        (0.8, True),
        (0.3, False),
        (0.7, True),
        (0.6, False),
        (0.5, False),
        (0.4, False),
        (0.2, False),
        (0.1, True),
    ]


def test_calibration_error_is_the_gap_of_activation_and_accuracy_by_bin() -> None:
    too_sure = [(0.95, True)] * 3 + [(0.95, False)]
    both_bins = too_sure + [(0.3, False)] * 4
    calibrated = [(1.0, True), (0.0, False)]

    assert objects.calibration_error(too_sure) == pytest.approx(0.2)
    assert objects.calibration_error(both_bins) == pytest.approx((0.2 + 0.3) / 2)
    assert objects.calibration_error(calibrated) == 0.0
    assert math.isnan(objects.calibration_error([]))
