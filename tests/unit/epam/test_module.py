"""The extended PAM as a module: percepts for every view, invalid views refused, nothing forgotten
and nothing learned twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import cv2
import msgspec
import numpy as np
import pytest

from cogmap.bus import codec
from cogmap.errors import ConfigError, MessageError
from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP
from cogmap.runtime.state.journal import Journal
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Broadcast, Coalition, Competition, Trigger
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.sensing import Learned, Percepts, View
from cogmap.services.epam.module import Config, build
from cogmap.testing import landmark, of_type
from cogmap.training.rendering.towns import render_town
from tests.support.world.blocks import CAMERA, Block, painted
from tests.support.world.rendered import seen

TOWN = 4005


@pytest.fixture(scope="module")
def views() -> list[View]:
    """Views of a town of which half the buildings were not taught."""
    return seen(render_town(TOWN, 8, 14))


def _percepts(module: Module, view: View) -> Percepts:
    (found,) = of_type(Percepts, module.feed(view))
    return found


def _view(image: np.ndarray, depth_m: np.ndarray) -> View:
    return View(
        stamp_ns=5, frame=3, image=Array.of(image), depth_m=Array.of(depth_m), calibration=CAMERA
    )


def _learned(module: Module, view: View) -> list[Learned]:
    return of_type(Learned, module.feed(view))


def _contents(messages: Sequence[Message]) -> list[bytes]:
    """Their bytes, apart from how many were published before."""
    return [
        codec.encode(msgspec.structs.replace(message, seq=0, source="")) for message in messages
    ]


def test_a_view_without_contrast_gives_empty_percepts() -> None:
    black = np.zeros((240, 320, 3), np.uint8)
    unknown = np.zeros((240, 320), np.float32)
    (percepts,) = build(Config(), "epam").feed(_view(black, unknown))

    assert isinstance(percepts, Percepts)
    assert percepts.objects == []
    assert percepts.matches == []
    assert percepts.road_m.shape == (0, 2)
    assert percepts.road_boundary_m.shape == (0, 2)
    assert (percepts.stamp_ns, percepts.frame) == (5, 3)


def test_a_segment_under_the_threshold_is_no_percept(views: list[View]) -> None:
    some, fewer, none = (
        sum(
            len(_percepts(build(Config(percept_threshold=threshold), "epam"), view).objects)
            for view in views
        )
        for threshold in (0.0, 0.9, 1.0)
    )

    assert some > fewer > none == 0


def test_a_percept_is_outlined_boxed_and_measured(views: list[View]) -> None:
    module = build(Config(), "epam")
    found = []
    for view in views:
        found += _percepts(module, view).objects
    assert len(found) > 5

    for percept in found:
        columns, rows = np.array(percept.outline_px).T
        left, top, wide, high = percept.box_px

        assert left - 1 <= columns.min() <= columns.max() <= left + wide
        assert top - 1 <= rows.min() <= rows.max() <= top + high
        assert percept.height_m > 1.0
        assert percept.width_m > 1.0


def test_which_individual_a_percept_is_of_is_left_to_the_workspace(views: list[View]) -> None:
    module = build(Config(), "epam")
    found = [percept for view in views for percept in _percepts(module, view).objects]

    assert {percept.label for percept in found} == {""}
    assert all(percept.appearance is not None for percept in found)


def test_a_building_that_was_not_taught_is_a_percept_without_a_name(views: list[View]) -> None:
    module = build(Config(), "epam")
    found = [percept for view in views for percept in _percepts(module, view).objects]
    nameless = [percept for percept in found if not percept.name]

    assert 0 < len(nameless) < len(found)
    for percept in nameless:
        assert percept.activation > Config().percept_threshold
        assert percept.evidence == 0.0
        assert sum(percept.names.values()) < 0.5


def test_the_same_views_give_the_same_bytes(views: list[View]) -> None:
    first = build(Config(), "epam")
    second = build(Config(), "epam")

    for view in views:
        answers = [codec.encode(answer) for answer in first.feed(view)]
        again = [codec.encode(answer) for answer in second.feed(view)]
        assert answers == again


def test_views_learned_before_a_restart_are_known_after_it(
    views: list[View], tmp_path: Path
) -> None:
    first = build(Config(), "epam")
    assert first.journal is topics.LEARNED
    journal = Journal(tmp_path / "epam")
    assert list(journal.messages()) == []
    for view in views:
        for learned in _learned(first, view):
            journal.append(learned, codec.encode(learned))
    journal.close()

    again = build(Config(), "epam")
    assert again.restore is not None
    again.restore(Journal(tmp_path / "epam").messages())
    assert first.compact is not None
    assert again.compact is not None
    assert codec.encode(again.compact()) == codec.encode(first.compact())

    learned = first.compact()
    assert isinstance(learned, Learned)
    assert learned.views


def test_a_view_published_again_gets_its_percepts_again_and_teaches_nothing(
    views: list[View],
) -> None:
    module = build(Config(), "epam")
    for view in views:
        *learned, percepts = module.feed(view)
        again = module.feed(view)

        assert len(learned) <= 1
        assert _contents(again) == _contents([percepts])


def test_a_restart_amid_a_view_learns_nothing_from_it_twice(
    views: list[View], tmp_path: Path
) -> None:
    first = build(Config(), "epam")
    journal = Journal(tmp_path / "epam")
    assert list(journal.messages()) == []

    view = views[0]
    learned, percepts = first.feed(view)
    journal.append(learned, codec.encode(learned))
    journal.close()

    assert isinstance(learned, Learned)
    assert learned.views

    second = build(Config(), "epam")
    assert second.restore is not None

    second.restore(Journal(tmp_path / "epam").messages())
    (again,) = second.feed(view)

    assert isinstance(percepts, Percepts)
    assert isinstance(again, Percepts)
    assert _contents([again]) == _contents([percepts])
    assert second.compact is not None
    assert first.compact is not None
    assert codec.encode(second.compact()) == codec.encode(first.compact())


def test_the_last_view_learned_from_before_a_restart_teaches_nothing(views: list[View]) -> None:
    view = views[1]
    fresh = build(Config(), "epam")
    answers = [type(message) for message in fresh.feed(view)]
    assert answers == [Learned, Percepts]

    restarted = build(Config(), "epam")
    assert restarted.restore is not None
    restarted.restore([Learned(stamp_ns=view.stamp_ns, frame=view.frame)])
    answers = [type(message) for message in restarted.feed(view)]
    assert answers == [Percepts]


def test_after_a_restart_the_next_view_is_learned_from(views: list[View]) -> None:
    first = build(Config(), "epam")
    second = build(Config(), "epam")
    assert second.restore is not None
    second.restore(first.feed(views[0]))

    learned = []
    for view in views[1:]:
        expected = _learned(first, view)
        found = _learned(second, view)
        assert _contents(found) == _contents(expected)
        learned += found

    assert learned


def test_a_first_view_at_time_0_is_learned_from(views: list[View]) -> None:
    module = build(Config(), "epam")
    at_start = msgspec.structs.replace(views[0], stamp_ns=0, frame=0)

    learned, _ = module.feed(at_start)
    assert isinstance(learned, Learned)


def test_one_message_stands_for_all_that_was_learned(views: list[View]) -> None:
    module = build(Config(), "epam")
    learned = [said for view in views for said in _learned(module, view)]
    remembered = [view.view_ns for said in learned for view in said.views]
    assert module.compact is not None

    everything = module.compact()

    assert isinstance(everything, Learned)
    assert [view.view_ns for view in everything.views] == remembered
    assert len(remembered) > 3


@pytest.mark.parametrize(
    ("image", "depth"),
    [
        (np.zeros((240, 319, 3), np.uint8), np.zeros((240, 320), np.float32)),
        (np.zeros((240, 320), np.uint8), np.zeros((240, 320), np.float32)),
        (np.zeros((240, 320, 3), np.float32), np.zeros((240, 320), np.float32)),
        (np.zeros((240, 320, 3), np.uint8), np.zeros((240, 320), np.float64)),
        (np.zeros((240, 320, 3), np.uint8), np.full((240, 320), -1, np.float32)),
    ],
)
def test_an_invalid_view_is_refused(image: np.ndarray, depth: np.ndarray) -> None:
    module = build(Config(), "epam")
    invalid = _view(image, depth)

    with pytest.raises(MessageError, match="view"):
        module.feed(invalid)


def test_a_view_of_noise_gives_valid_messages() -> None:
    module = build(Config(), "epam")
    for seed in range(4):
        rng = np.random.default_rng(seed)
        image = rng.integers(0, 256, (240, 320, 3), np.uint8)
        exponent = rng.uniform(-30, 30, (240, 320))
        depth_m = (10.0**exponent).astype(np.float32)
        view = msgspec.structs.replace(_view(image, depth_m), frame=seed)

        answers = module.feed(view)
        assert answers
        for answer in answers:
            assert codec.decode(topics.of(answer), codec.encode(answer)) == answer


@pytest.mark.parametrize("weights", ["segments_weights", "object_weights", "road_weights"])
def test_missing_weights_are_named_with_the_remedy(weights: str, tmp_path: Path) -> None:
    config = Config(**{weights: str(tmp_path / "nowhere.onnx")})

    with pytest.raises(ConfigError, match=r"nowhere\.onnx.*cogmap train"):
        build(config, "epam")


@pytest.mark.parametrize("size", [(320, 240), (613, 185), (752, 480)])
@pytest.mark.parametrize("weights", ["rendered", "camvid"])
def test_a_camera_of_any_size_has_percepts_within_its_image(
    weights: Literal["rendered", "camvid"], size: tuple[int, int]
) -> None:
    image, depth_m, _ = painted([Block(20.0, 9.0, 0.2, (8.0, 8.0), 6.0, (180, 60, 50))])
    columns, rows = size
    camera = msgspec.structs.replace(
        CAMERA,
        width_px=columns,
        height_px=rows,
        fx_px=CAMERA.fx_px * columns / CAMERA.width_px,
        fy_px=CAMERA.fy_px * rows / CAMERA.height_px,
        cx_px=(columns - 1) / 2,
        cy_px=(rows - 1) / 2,
    )
    view = View(
        stamp_ns=5,
        frame=3,
        image=Array.of(cv2.resize(image, size)),
        depth_m=Array.of(cv2.resize(depth_m, size, interpolation=cv2.INTER_NEAREST)),
        calibration=camera,
    )
    percepts = _percepts(build(Config(weights=weights), "epam"), view)

    assert len(percepts.road_m.numpy()) > 0
    for percept in percepts.objects:
        left, top, width, height = percept.box_px
        assert 0 <= left < left + width <= columns
        assert 0 <= top < top + height <= rows


def _broadcast(stamp_ns: int, *labels: str, feeling: Feeling = Feeling.NONE) -> Broadcast:
    nodes = [landmark(label) for label in labels]
    coalition = Coalition(codelet="whereabouts", activation=0.5, nodes=[*nodes], feeling=feeling)
    return Broadcast(stamp_ns=stamp_ns, cycle=1, trigger=Trigger.ONE_COALITION, coalition=coalition)


def _competition(stamp_ns: int) -> Competition:
    return Competition(stamp_ns=stamp_ns, cycle=1, contenders=[], trigger=Trigger.NONE)


def test_in_lockstep_a_view_waits_for_the_competition_that_primes_it(views: list[View]) -> None:
    module = build(Config(), "epam", LOCKSTEP)
    for view in views[:2]:
        assert of_type(Percepts, module.feed(view))

    assert module.feed(views[2]) == []
    (percepts,) = of_type(Percepts, module.feed(_competition(views[0].stamp_ns)))
    assert percepts.stamp_ns == views[2].stamp_ns


def test_in_lockstep_a_view_that_comes_again_waits_for_nothing(views: list[View]) -> None:
    module = build(Config(), "epam", LOCKSTEP)
    for view in views[:3]:
        module.feed(view)

    assert of_type(Percepts, module.feed(views[2]))


def test_what_was_conscious_raises_the_activation_of_what_goes_with_it_and_no_evidence(
    views: list[View],
) -> None:
    bare = build(Config(), "epam")
    before = [_percepts(bare, view) for view in views]
    seen_names = {percept.name for percepts in before for percept in percepts.objects}
    conscious = sorted(name for name in seen_names if name)

    primed = build(Config(), "epam")
    for _ in range(20):
        primed.feed(_broadcast(views[0].stamp_ns, *conscious))
    after = [_percepts(primed, view) for view in views]

    gains = []
    for without, with_it in zip(before[2:], after[2:], strict=True):
        expected = {percept.name: percept for percept in with_it.objects if percept.name}
        for percept in without.objects:
            found = expected.get(percept.name)
            if found is not None and found.box_px == percept.box_px:
                assert found.evidence == percept.evidence
                gains.append(found.activation - percept.activation)

    assert max(gains) > 0.0


def test_what_was_conscious_with_danger_is_perceived_with_it_and_also_after_a_restart(
    views: list[View],
) -> None:
    calm = build(Config(), "epam")
    named = []
    for view in views:
        found = [percept for percept in _percepts(calm, view).objects if percept.name]
        named.append(found)

    # The last view that shows a building with a name.
    number = max(place for place, found in enumerate(named) if found)
    before, last = views[:number], views[number]
    clearest = max(named[number], key=lambda percept: percept.activation).name
    module = build(Config(), "epam")
    for view in before:
        module.feed(view)
    module.feed(_broadcast(views[0].stamp_ns, clearest, feeling=Feeling.DANGER))
    (percepts,) = of_type(Percepts, module.feed(last))

    again = build(Config(), "epam")
    assert again.restore is not None
    assert module.compact is not None
    again.restore([module.compact()])
    (restarted,) = of_type(Percepts, again.feed(last))

    felt = {percept.name: percept.salience for percept in percepts.objects}
    again_felt = {percept.name: percept.salience for percept in restarted.objects}
    assert again_felt == pytest.approx(felt, abs=0.01)

    assert felt.pop(clearest) < 0.0
    assert set(felt.values()) == {0.0}
