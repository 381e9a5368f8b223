"""The extended PAM: names what it has learned, passes over what it has not, and says so for every view."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from blocks import CAMERA, Block, Colour, painted, view

from bus import codec
from bus.errors import ConfigError, MessageError, UsageError
from schemas import topics
from schemas.array import Array
from schemas.sensing import Percepts, View
from services.epam.appearance import Appearance, load
from services.epam.learn import LabelledView, TownViews, learn, main, read
from services.epam.module import Config, ExtendedPam, build

RED, BLUE, VIOLET = (190, 50, 40), (40, 70, 190), (150, 40, 170)
SIDES_M, HEIGHT_M = {"red": (10.0, 8.0), "blue": (12.0, 7.0)}, {"red": 7.0, "blue": 9.0}


def _block(name: str, x_m: float, y_m: float, turn_rad: float = 0.0, colour: Colour | None = None) -> Block:
    paint = colour or {"red": RED, "blue": BLUE}[name]
    return Block(x_m, y_m, turn_rad, SIDES_M[name], HEIGHT_M[name], paint)


def _town() -> TownViews:
    """Both buildings, seen from twelve places all around them."""
    views = []
    for number in range(12):
        angle = number * math.tau / 12
        at = np.array([-22 * math.cos(angle), -22 * math.sin(angle)])
        turned = [
            _block(name, *_robot_frame(np.array(centre) - at, angle), turn_rad=-angle)
            for name, centre in (("red", (0.0, 7.0)), ("blue", (0.0, -7.0)))
        ]
        image, depth_m, label = painted(turned, seed=number)
        views.append(LabelledView(image, depth_m, label, np.array([*at, angle]), CAMERA))
    return TownViews(("red", "blue"), views)


def _robot_frame(offset: np.ndarray, heading_rad: float) -> tuple[float, float]:
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    return float(cos * offset[0] + sin * offset[1]), float(-sin * offset[0] + cos * offset[1])


@pytest.fixture(scope="module")
def model() -> Appearance:
    return learn(iter([_town()]))


def _percepts(model: Appearance, *blocks: Block, config: Config | None = None) -> Percepts:
    return ExtendedPam(config or Config(), model).recognise(view(list(blocks), frame=7))


def test_sizes_and_tops_are_learned_from_views_all_around(model: Appearance) -> None:
    np.testing.assert_allclose(model.footprint_m, [SIDES_M["red"], SIDES_M["blue"]], rtol=0.06)
    np.testing.assert_allclose(model.height_m, [HEIGHT_M["red"], HEIGHT_M["blue"]], rtol=0.03)


def test_learned_buildings_are_named_and_placed_at_their_centres(model: Appearance) -> None:
    said = _percepts(model, _block("red", 24.0, 7.0, 0.3), _block("blue", 28.0, -8.0, 1.1))
    assert [percept.label for percept in said.objects] == ["red", "blue"]
    for percept, (x_m, y_m) in zip(said.objects, ((24.0, 7.0), (28.0, -8.0)), strict=True):
        assert percept.activation > 0.7
        assert percept.whole
        assert percept.range_m == pytest.approx(math.hypot(x_m, y_m), abs=0.5)
        assert percept.bearing_rad == pytest.approx(math.atan2(y_m, x_m), abs=0.02)


def test_neighbours_of_different_colour_are_told_apart_where_they_touch(model: Appearance) -> None:
    said = _percepts(model, _block("red", 24.0, 4.0), _block("blue", 24.0, -3.5))
    assert {percept.label for percept in said.objects} == {"red", "blue"}


def test_a_building_that_the_image_cuts_is_not_whole_and_a_hidden_one_neither(model: Appearance) -> None:
    cut = _percepts(model, _block("red", 16.0, -12.0)).objects[0]
    assert not cut.whole
    hiding = _percepts(model, _block("red", 16.0, 3.0), _block("blue", 32.0, -3.0)).objects
    assert {percept.label: percept.whole for percept in hiding} == {"red": True, "blue": False}


def test_what_was_never_learned_gets_no_percept(model: Appearance) -> None:
    assert _percepts(model, _block("red", 24.0, 0.0, colour=VIOLET)).objects == []


def test_every_view_is_answered_by_one_message_even_where_nothing_is_seen(model: Appearance) -> None:
    blank = View(
        stamp_ns=5,
        frame=3,
        image=Array.of(np.zeros((240, 320, 3), np.uint8)),
        depth_m=Array.of(np.zeros((240, 320), np.float32)),
        calibration=CAMERA,
    )
    said = build(Config(), "epam").feed(blank)
    assert len(said) == 1
    assert isinstance(said[0], Percepts)
    assert (said[0].objects, said[0].road_m.shape, said[0].stamp_ns, said[0].frame) == ([], (0, 2), 5, 3)


def test_a_node_must_be_over_the_threshold_not_at_it(model: Appearance) -> None:
    scene = [_block("red", 24.0, 0.0)]
    activation = _percepts(model, *scene).objects[0].activation
    assert _percepts(model, *scene, config=Config(percept_threshold=activation)).objects == []
    assert len(_percepts(model, *scene, config=Config(percept_threshold=activation - 1e-6)).objects) == 1


def test_the_same_view_gives_the_same_bytes(model: Appearance) -> None:
    scene = [_block("red", 24.0, 7.0, 0.3), _block("blue", 28.0, -8.0, 1.1)]
    answers = [codec.encode(_percepts(model, *scene)) for _ in range(2)]
    assert answers[0] == answers[1]
    assert isinstance(codec.decode(topics.PERCEPTS, answers[0]), Percepts)


@pytest.mark.parametrize(
    ("image", "depth"),
    [
        (np.zeros((240, 319, 3), np.uint8), np.zeros((240, 320), np.float32)),
        (np.zeros((240, 320), np.uint8), np.zeros((240, 320), np.float32)),
        (np.zeros((240, 320, 3), np.uint8), np.zeros((240, 320), np.float64)),
        (np.zeros((240, 320, 3), np.uint8), np.full((240, 320), -1, np.float32)),
    ],
)
def test_a_view_that_makes_no_sense_is_refused(model: Appearance, image: np.ndarray, depth: np.ndarray) -> None:
    senseless = View(frame=0, image=Array.of(image), depth_m=Array.of(depth), calibration=CAMERA)
    with pytest.raises(MessageError, match="view"):
        ExtendedPam(Config(), model).recognise(senseless)


def test_noise_for_a_view_is_taken_in_and_gives_sound_messages(model: Appearance) -> None:
    pam = ExtendedPam(Config(), model)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        noise = View(
            frame=seed,
            image=Array.of(rng.integers(0, 256, (240, 320, 3), np.uint8)),
            depth_m=Array.of((10.0 ** rng.uniform(-30, 30, (240, 320))).astype(np.float32)),
            calibration=CAMERA,
        )
        codec.decode(topics.PERCEPTS, codec.encode(pam.recognise(noise)))


def test_a_model_written_and_read_again_is_the_same(model: Appearance, tmp_path: Path) -> None:
    model.save(tmp_path / "m.npz")
    again = load(tmp_path / "m.npz")
    assert again.names == model.names
    np.testing.assert_allclose(again.log_colour, model.log_colour, atol=0.01)
    np.testing.assert_array_equal(again.footprint_m, model.footprint_m)


def test_a_missing_or_broken_model_is_named_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.npz.*services\.epam\.learn"):
        build(Config(model=str(tmp_path / "nowhere.npz")), "epam")
    (tmp_path / "broken.npz").write_bytes(b"no model")
    with pytest.raises(ConfigError, match=r"broken\.npz"):
        build(Config(model=str(tmp_path / "broken.npz")), "epam")


def test_learning_from_a_wrong_folder_or_too_little_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["learn", str(tmp_path)])
    with pytest.raises(SystemExit, match=r"no town-\*\.npz"):
        main()
    (tmp_path / "town-1.npz").write_bytes(b"nothing")
    with pytest.raises(UsageError, match=r"town-1\.npz"):
        read(tmp_path / "town-1.npz")
    few = _town()
    with pytest.raises(UsageError, match="too few views of red, blue"):
        learn(iter([TownViews(few.names, few.views[:1])]))
