"""What the perception benchmark counts, on views so small that the right answer is known; and what
it refuses.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from click.testing import CliRunner

from benchmarks.commands import benchmarks
from benchmarks.perception import depth, objects, scenes, stereo, streets
from benchmarks.perception.measure import THRESHOLDS
from benchmarks.perception.novel import Meeting, remembered
from benchmarks.perception.objects import Building, Segment, Sight
from cogmap.errors import UsageError
from schemas.sensing import Percept, Pose
from services.sim.layout import town
from training.rendering import towns

TRAINED = frozenset({"bakery", "bank"})
Mask = npt.NDArray[np.bool_]


def _label() -> npt.NDArray[np.uint8]:
    """Building 0 on the left, 20 pixels, building 1 on the right, 10 pixels, of 100."""
    label = np.zeros((10, 10), np.uint8)
    label[2:7, 0:4] = 1
    label[2:7, 8:10] = 2
    return label


def _mask(rows: slice, columns: slice) -> Mask:
    mask = np.zeros((10, 10), bool)
    mask[rows, columns] = True
    return mask


def _segment(
    label: str, building: Building | None, activation: float = 0.9, share: float = 0.1
) -> Segment:
    return Segment(label, activation, share, building, building)


def test_the_bars_are_those_that_were_promised() -> None:
    assert {name: str(bar) for name, bar in THRESHOLDS.items()} == {
        "top1": "≥ 0.97",
        "ece": "≤ 0.05",
        "detect_recall": "≥ 0.95",
        "detect_precision": "≥ 0.95",
        "novel_top1": "≥ 0.85",
        "road_iou": "≥ 0.93",
        "road_edge_error_m": "≤ 0.25",
        "depth_error": "≤ 0.04",
        "sequence_recall_at_99p": "≥ 0.8",
        "frame_ms_p50": "≤ 60",
    }


def test_an_outline_holds_its_corners_and_what_is_between_them() -> None:
    percept = Percept(
        label="bakery",
        activation=0.9,
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

    np.testing.assert_array_equal(
        objects.filled(percept, (10, 10)), _mask(slice(1, 4), slice(2, 6))
    )


def test_a_claim_matches_the_building_it_half_covers_and_no_other_claim_does() -> None:
    whole = _mask(slice(2, 7), slice(0, 4))
    half = _mask(slice(2, 7), slice(0, 2))
    other = _mask(slice(0, 3), slice(8, 10))
    claims = [("bank", 0.8, half), ("bakery", 0.9, whole), ("bank", 0.7, other)]

    seen = objects.sight(claims, _label(), ["bakery", "bank"], [10.0, 20.0])

    assert [(b.number, b.kind, b.share, b.range_m) for b in seen.buildings] == [
        (0, "bakery", 0.2, 10.0),
        (1, "bank", 0.1, 20.0),
    ]
    assert [s.building.kind if s.building else None for s in seen.segments] == [
        None,
        "bakery",
        None,
    ]
    assert [s.shows.kind if s.shows else None for s in seen.segments] == ["bakery", "bakery", None]
    assert [s.share for s in seen.segments] == [0.1, 0.2, 0.06]


def test_a_name_counts_where_a_trained_building_in_range_is_matched() -> None:
    near = Building(0, "bakery", 0.2, 10.0)
    far = Building(1, "bank", 0.1, 70.0)
    unknown = Building(2, "invented", 0.1, 10.0)
    wrong = _segment("bank", near)
    right = _segment("bakery", near)
    sights = [
        Sight((near,), (wrong,)),
        Sight((near, far), (right, _segment("bakery", far), _segment("bank", unknown))),
    ]

    assert objects.named(sights, TRAINED, 5.0, 60.0) == [False, True]


def test_detection_counts_large_buildings_found_and_large_segments_right() -> None:
    large = Building(0, "bakery", 0.2, 10.0)
    small = Building(1, "bank", 0.009, 50.0)
    speck = _segment("bank", None, share=0.005)
    miss = _segment("bank", None)
    sights = [
        Sight((large, small), (_segment("bakery", large), _segment("bank", small), speck)),
        Sight((large,), (miss,)),
    ]

    assert objects.detection(sights) == (1, 2, 2, 3)


def test_a_learned_label_is_right_for_the_building_it_was_given_to() -> None:
    taught = Building(0, "bakery", 0.2, 10.0)
    novel = Building(1, "invented-1", 0.2, 9.0)
    other = Building(2, "invented-2", 0.2, 9.0)
    before = [
        Sight(
            (),
            (
                _segment("bakery", taught, 0.9),
                _segment("", novel, 0.8),
                _segment("bank", None, 0.3),
            ),
        ),
        Sight(
            (),
            (
                _segment("new-1", novel, 0.7),
                _segment("new-1", other, 0.6),
                _segment("", novel, 0.5),
            ),
        ),
        Sight(
            (), (_segment("", taught, 0.4), _segment("new-1", taught, 0.2), _segment("", None, 0.1))
        ),
    ]
    after = [
        Sight((), (_segment("bakery", taught), _segment("new-1", novel))),
        Sight((), ()),
        Sight((), ()),
    ]

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
    sure = [(0.95, True)] * 3 + [(0.95, False)]

    assert objects.calibration_error(sure) == pytest.approx(0.2)
    assert objects.calibration_error(sure + [(0.3, False)] * 4) == pytest.approx((0.2 + 0.3) / 2)
    assert objects.calibration_error([(1.0, True), (0.0, False)]) == 0.0
    assert math.isnan(objects.calibration_error([]))


def _meeting(side_rad: float, range_m: float, *claims: tuple[int, str]) -> Meeting:
    """A view from that side and distance of three buildings, and what each claim calls which of
    them.
    """
    segments = tuple(
        _segment(label, Building(number, f"invented-{number}", 0.1, range_m))
        for number, label in claims
    )
    return Meeting(Sight((), segments), np.array([[side_rad, range_m]] * 3))


def test_a_building_met_once_is_recognised_from_another_side_and_distance() -> None:
    met = [
        _meeting(0.0, 10.0, (0, "new-1")),
        _meeting(0.0, 10.0, (1, "new-2")),
        _meeting(0.0, 10.0),
    ]
    later = [
        _meeting(2.0, 20.0, (0, "new-1"), (1, "new-2")),
        _meeting(2.0, 20.0, (0, "new-2"), (1, "new-9")),
        _meeting(0.5, 20.0, (0, "new-7")),
        _meeting(2.0, 11.0, (0, "new-7")),
        _meeting(2.0, 5.0, (0, "bakery"), (2, "new-8")),
    ]

    memory = remembered(met, later, TRAINED)

    assert (memory.met, memory.later, memory.right) == (2, 6, 2)
    assert (memory.merges, memory.splits, memory.mistaken) == (1, 2, 1)


def test_a_building_met_under_the_name_of_another_is_never_recognised() -> None:
    met = [_meeting(0.0, 10.0, (0, "new-1"), (1, "new-1"), (2, "bakery"))] * 3
    later = [_meeting(math.pi, 20.0, (0, "new-1"), (1, "new-1"), (2, "bakery"))]

    memory = remembered(met, later, TRAINED)

    assert (memory.later, memory.right, memory.merges, memory.mistaken) == (3, 1, 2, 1)


def test_a_building_has_the_name_it_was_first_recognised_by_not_guessed() -> None:
    surely = _meeting(0.0, 10.0, (0, "new-1"))
    guessed = _meeting(0.0, 10.0, (0, "new-2"))
    unsure = replace(guessed.sight.segments[0], activation=0.7)
    guessed = replace(guessed, sight=replace(guessed.sight, segments=(unsure,)))
    later = [_meeting(math.pi, 20.0, (0, "new-1"))]

    assert remembered([guessed, surely], later, TRAINED).right == 1
    assert remembered([guessed, guessed], later, TRAINED).met == 0


def test_depth_is_judged_from_three_to_thirty_metres_where_it_is_known() -> None:
    true_m = np.array([[2.0, 10.0, 20.0, 31.0, 0.0, 4.0]], np.float32)
    depth_m = np.array([[1.0, 11.0, 19.0, 60.0, 5.0, 0.0]], np.float32)

    off, known = depth.errors(depth_m, true_m)

    np.testing.assert_allclose(off, [0.1, 0.05], rtol=1e-5)
    assert known == pytest.approx(2 / 3)


def test_streets_end_at_the_outline_of_them_all_and_not_where_they_cross() -> None:
    edges = streets.edges([(-20.0, -4.0, 20.0, 4.0), (-4.0, -20.0, 4.0, 20.0)])

    points = [(0.0, 0.0), (10.0, 3.0), (10.0, 5.5), (4.0, 4.0), (0.0, 4.0), (21.0, 0.0)]
    np.testing.assert_allclose(
        streets.distances_m(points, edges), [math.hypot(4, 4), 1.0, 1.5, 0.0, 4.0, 1.0]
    )
    assert streets.distances_m(np.empty((0, 2)), edges).shape == (0,)


def test_points_ahead_of_a_robot_that_looks_north_are_north_of_it() -> None:
    pose = Pose(x_m=1.0, y_m=2.0, heading_rad=math.pi / 2)

    np.testing.assert_allclose(
        streets.in_town([(3.0, 0.0), (0.0, 1.0)], pose), [(1.0, 5.0), (0.0, 2.0)], atol=1e-12
    )


def test_a_later_view_is_from_elsewhere_and_shows_the_building() -> None:
    place = town.generate(3001, towns.kinds(3001, 30))
    rng = np.random.default_rng(1)
    for target in range(5):
        first = scenes.encounter(place, target, rng)
        again = scenes.later(place, target, first, rng)
        assert np.count_nonzero(scenes.skyline(place, first) == target) > 8
        assert again is not None

        (side, near), (other, far) = (
            scenes.side_and_range(place, pose)[target] for pose in (first, again)
        )

        assert abs(math.remainder(side - other, math.tau)) >= math.radians(45) - 1e-9
        assert max(near, far) / min(near, far) >= 1.3
        assert 5 <= far <= 60
        assert (scenes.skyline(place, again) == target).any()


def test_a_pixel_errs_where_it_is_wrong_or_unmatched_and_the_truth_known() -> None:
    true_px = np.array([[10.0, 10.0, 10.0, 10.0, 0.0]], np.float32)
    found_px = np.array([[10.5, 12.0, 14.0, 0.0, 3.0]], np.float32)

    assert stereo.off_share(found_px, true_px, 1) == 0.75
    assert stereo.off_share(found_px, true_px, 3) == 0.5
    assert stereo.unmatched(found_px, true_px) == 0.25


def _pair(folder: Path) -> tuple[Path, Path, Path]:
    """A textured wall, 8 pixels of disparity, as files."""
    noise = np.random.default_rng(4).integers(0, 255, (96, 168, 3), np.uint8)
    wall = cv2.GaussianBlur(noise, (0, 0), 1.0)
    paths = tuple(folder / name for name in ("left.png", "right.png", "disparity.png"))
    for path, image in zip(
        paths, (wall[:, :160], wall[:, 8:], np.full((96, 160), 32, np.uint8)), strict=True
    ):
        cv2.imwrite(str(path), image)
    return paths[0], paths[1], paths[2]


def test_a_pair_of_ones_own_is_matched_by_ours_and_by_plain(tmp_path: Path) -> None:
    json_path = tmp_path / "figures.json"
    arguments = [
        "perception",
        "--stereo",
        *map(str, _pair(tmp_path)),
        "--scale",
        "4",
        "--json",
        str(json_path),
    ]

    result = CliRunner().invoke(benchmarks, arguments)

    assert result.exit_code == 0, result.output
    assert '"stereo_off_1px"' in json_path.read_text()

    metrics = stereo.measure(*_pair(tmp_path), 4.0)
    assert metrics["stereo_off_1px"] < 0.1

    ratio = metrics["stereo_off_1px"] / metrics["plain_off_1px"]
    assert metrics["stereo_off_1px_over_plain"] == pytest.approx(ratio)


@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_file_that_is_missing_or_no_image_or_of_another_size_is_named(
    which: int, tmp_path: Path
) -> None:
    pair = _pair(tmp_path)
    paths = list(pair)
    for wrong, said in (
        (None, "there is no file"),
        (b"text", "no image"),
        (np.zeros((20, 30), np.uint8), "of one size"),
    ):
        path = paths[which] = tmp_path / "wrong.png"
        path.unlink(missing_ok=True)
        if isinstance(wrong, bytes):
            path.write_bytes(wrong)
        elif wrong is not None:
            cv2.imwrite(str(path), wrong + 4)

        with pytest.raises(UsageError, match=said) as refused:
            stereo.measure(paths[0], paths[1], paths[2], 4.0)
        assert "wrong.png" in str(refused.value)


def test_disparities_without_sense_are_refused(tmp_path: Path) -> None:
    left, right, disparity = _pair(tmp_path)
    with pytest.raises(UsageError, match="--scale"):
        stereo.measure(left, right, disparity, 0.1)
    with pytest.raises(UsageError, match="one channel"):
        stereo.measure(left, right, left, 1.0)

    cv2.imwrite(str(disparity), np.zeros((96, 160), np.uint8))
    with pytest.raises(UsageError, match="no disparity over 0"):
        stereo.measure(left, right, disparity, 1.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scale", "4"], "belongs to --stereo"),
        (["--road-weights", "road.onnx"], "belongs to --camvid-test"),
        (["--stereo", "a", "b", "c", "--scale", "0"], "--scale"),
        (["--stereo", "a", "b"], "--stereo"),
        (["--json", "nowhere/figures.json"], "there is no folder"),
    ],
)
def test_options_that_do_not_go_together_are_refused_in_a_sentence(
    arguments: list[str], said: str
) -> None:
    result = CliRunner().invoke(benchmarks, ["perception", *arguments])

    assert result.exit_code == 2
    assert said in result.output
