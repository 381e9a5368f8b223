"""Places are recognized by the views that lead to them, in another light, at another speed, with
another heading.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from cogmap.errors import MessageError
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import PlaceMatch, RememberedView
from cogmap.services.epam import backbone
from cogmap.services.epam.places.descriptor import CODE_BYTES, code, shows_place
from cogmap.services.epam.places.recognizer import PlaceRecognizer
from cogmap.services.epam.places.standard import Standard

Image = npt.NDArray[np.uint8]
Code = npt.NDArray[np.uint8]
HEIGHT = 240
WIDTH = 320
LENGTH = 60
NEAR = np.full((HEIGHT, WIDTH), 10.0, np.float32)
PERIOD_NS = 200_000_000
SIDEWAYS_PX = 20
DUSK = np.array([1.1, 1.0, 0.85])


@cache
def _backbone() -> backbone.Backbone:
    return backbone.load()


def _code(image: Image) -> Code | None:
    """The code of a view of what is near."""
    return code(_backbone().features(image)) if shows_place(image, NEAR) else None


class Route:
    """A route whose views, at every place from 0 to LENGTH, blend into one another."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        coarse = rng.uniform(30, 220, (LENGTH // 2 + 2, 9, 12, 3)).astype(np.float32)
        size = (WIDTH + 2 * SIDEWAYS_PX, HEIGHT)
        self._pictures = [cv2.resize(picture, size) for picture in coarse]

    def view(self, place: float, aside_px: int = 0, evening: bool = False) -> Image:
        """The view at `place`, of a robot that is turned a little."""
        before, share = divmod(place / 2, 1.0)
        last = self._pictures[int(before)]
        following = self._pictures[int(before) + 1]
        blended = last * (1 - share) + following * share

        left = SIDEWAYS_PX + aside_px
        picture = blended[:, left : left + WIDTH] / 255
        if evening:
            picture = 0.6 * picture**1.2 * DUSK

        rng = np.random.default_rng(int(1000 * place))
        noise = rng.normal(0, 0.01, picture.shape)
        levels = np.clip(255 * (picture + noise), 0, 255)
        return np.asarray(levels, np.uint8)

    def code(self, place: float, aside_px: int = 0, evening: bool = False) -> Code | None:
        """The code of that view."""
        return _code(self.view(place, aside_px, evening))


@cache
def _route(seed: int) -> Route:
    return Route(seed)


def _drive(
    recognizer: PlaceRecognizer, views: list[Code | None], first: int = 0
) -> tuple[list[PlaceMatch | None], list[RememberedView]]:
    matches: list[PlaceMatch | None] = []
    remembered = []
    for number, view in enumerate(views, first):
        found, new = recognizer.observe(number, PERIOD_NS * number, view)
        assert len(found) <= 1
        matches.append(found[0] if found else None)
        remembered += new

    return matches, remembered


def _along(route: Route, places: Iterable[float]) -> list[Code | None]:
    """The codes of the views of a route at some of its places."""
    return [route.code(place) for place in places]


@cache
def _lap(route: Route) -> list[Code | None]:
    return _along(route, range(LENGTH))


def _recognizer_after(route: Route) -> PlaceRecognizer:
    recognizer = PlaceRecognizer()
    _drive(recognizer, _lap(route))
    return recognizer


def test_a_route_is_recognized_in_other_light_at_other_speed_and_heading() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)
    places = np.arange(0, LENGTH - 15, 1.4)
    evening = [route.code(place, 10, evening=True) for place in places]

    matches, _ = _drive(recognizer, evening, LENGTH)

    errors = []
    for match, place in zip(matches, places, strict=True):
        if match is not None:
            assert match.score >= 0.9
            assert match.view_ns == PERIOD_NS * match.frame
            errors.append(abs(match.frame - place))
    assert len(errors) >= 0.7 * len(places)
    assert max(errors) <= 2.0


def test_on_a_new_route_nothing_matches_and_every_view_is_remembered() -> None:
    recognizer = _recognizer_after(_route(1))
    new_route = _route(2)

    matches, remembered = _drive(recognizer, _lap(new_route), LENGTH)
    frames = [view.frame for view in remembered]

    assert not any(matches)
    assert frames == list(range(LENGTH, 2 * LENGTH))


def test_a_route_that_is_approached_from_its_other_end_matches_nothing() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)
    mirrored = [
        _code(np.ascontiguousarray(route.view(place)[:, ::-1]))
        for place in range(LENGTH - 1, 0, -1)
    ]

    matches, _ = _drive(recognizer, mirrored, LENGTH)

    assert not any(matches)


def test_a_single_view_is_no_match() -> None:
    route = _route(1)
    other = _route(2)
    recognizer = _recognizer_after(route)
    before = _along(other, range(10))
    after = _along(other, range(10, 20))

    matches, _ = _drive(recognizer, [*before, route.code(15), *after], LENGTH)

    assert not any(matches)


def test_the_most_recent_views_do_not_match() -> None:
    there = _along(_route(1), range(12))
    matches, _ = _drive(PlaceRecognizer(), [*there, *there])

    assert not any(matches)


def test_a_recognized_place_is_not_remembered_again() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)
    evening = [route.code(place, evening=True) for place in range(30)]

    matches, remembered = _drive(recognizer, evening, LENGTH)

    recognized = {number for number, match in enumerate(matches, LENGTH) if match}
    assert len(recognized) >= 20
    assert not recognized & {view.frame for view in remembered}


def test_a_known_place_that_is_not_recognized_yet_is_not_remembered_again() -> None:
    route = _route(1)
    other = _route(2)
    recognizer = _recognizer_after(route)
    views = [*_along(other, range(10)), route.code(15), *_along(other, range(10, 20))]

    matches, remembered = _drive(recognizer, views, LENGTH)
    frames = {view.frame for view in remembered}

    assert not any(matches)
    assert frames == set(range(LENGTH, LENGTH + 21)) - {LENGTH + 10}


def test_lap_after_lap_adds_few_views() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)
    for lap in range(1, 6):
        _drive(recognizer, _lap(route), lap * LENGTH)

    assert len(list(recognizer.all)) <= 1.2 * LENGTH


def test_a_robot_at_rest_remembers_one_view() -> None:
    rng = np.random.default_rng(0)
    image = _route(1).view(3).astype(np.int16)
    noisy = []
    for _ in range(20):
        values = image + rng.normal(0, 5, image.shape)
        noisy.append(_code(np.clip(values, 0, 255).astype(np.uint8)))

    _, remembered = _drive(PlaceRecognizer(), noisy)

    assert len(remembered) == 1


def test_at_rest_the_last_match_is_returned_again() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)
    until_rest = _along(route, [*range(12), 11, 11])

    matches, _ = _drive(recognizer, until_rest, LENGTH)

    assert matches[-1] is not None
    assert matches[-3] == matches[-2] == matches[-1]


@pytest.mark.parametrize(
    ("image", "depth_m"),
    [
        (np.zeros((HEIGHT, WIDTH, 3), np.uint8), NEAR),
        (np.full((HEIGHT, WIDTH, 3), 140, np.uint8), NEAR),
        (Route(1).view(4), np.zeros_like(NEAR)),
        (Route(1).view(4), NEAR + 100),
    ],
    ids=["black", "blank", "of no known depth", "of what is far off alone"],
)
def test_a_view_of_nothing_near_shows_no_place(
    image: Image, depth_m: npt.NDArray[np.float32]
) -> None:
    assert not shows_place(image, depth_m)


def test_a_view_of_what_is_near_or_of_a_camera_without_depth_shows_a_place() -> None:
    image = _route(1).view(4)

    assert shows_place(image, NEAR)
    assert shows_place(image, None)


def test_a_view_that_shows_no_place_is_neither_remembered_nor_matched() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)

    matches, _ = _drive(recognizer, _along(route, range(10)), LENGTH)
    assert matches[-1] is not None

    assert recognizer.observe(99, 99, None) == ([], [])


def test_views_remembered_before_a_restart_are_recognized_after_it() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)
    restarted = PlaceRecognizer()
    for view in recognizer.all:
        restarted.restore([view])
    assert list(restarted.all) == list(recognizer.all)

    again = [route.code(place, evening=True) for place in range(30)]
    matches, _ = _drive(restarted, again, LENGTH)
    frames = [match.frame for match in matches[10:] if match]
    assert frames == list(range(10, 30))


def _likeness(standard: Standard, codes: list[Code | None]) -> float:
    """How alike successive views of different places are, on average."""
    vectors = np.stack([standard.add(code) for code in codes if code is not None])
    return float((vectors[:-1] * vectors[1:]).sum(axis=1).mean())


def test_what_another_light_has_in_common_is_usual_sooner_on_a_drive_after_a_restart() -> None:
    evening = [_route(2).code(place, evening=True) for place in range(0, 30, 3)]
    going_on = Standard()
    restarted = Standard()
    for standard in (going_on, restarted):
        _likeness(standard, _lap(_route(1)))

    restarted.begin_drive()

    assert _likeness(restarted, evening) < 0.8 * _likeness(going_on, evening)


def test_at_rest_after_a_restart_no_view_is_remembered_again() -> None:
    route = _route(1)
    recognizer = _recognizer_after(route)
    restarted = PlaceRecognizer()
    restarted.restore(recognizer.all)
    last = route.code(LENGTH - 1)

    assert restarted.observe(LENGTH, LENGTH, last) == ([], [])


def test_beyond_the_capacity_the_oldest_views_are_forgotten() -> None:
    first = _route(1)
    third = _route(3)
    recognizer = PlaceRecognizer(capacity=150)
    _drive(recognizer, [*_lap(first), *_lap(_route(2)), *_lap(third)])

    kept = [view.frame for view in recognizer.all]
    assert len(kept) <= 150
    assert kept == list(range(kept[0], 3 * LENGTH))

    beginning = range(20)
    forgotten, _ = _drive(recognizer, _along(first, beginning), 200)
    known, _ = _drive(recognizer, _along(third, beginning), 300)
    assert not any(forgotten)
    assert any(known)


def test_the_same_views_give_the_same_answers() -> None:
    route = _route(1)
    again = [route.code(place, 6, evening=True) for place in range(20)]
    views = [*_lap(route), *again]

    first_answers = _drive(PlaceRecognizer(), views)
    second_answers = _drive(PlaceRecognizer(), views)

    assert second_answers == first_answers


@pytest.mark.parametrize(
    "wrong", [np.zeros(CODE_BYTES - 1, np.uint8), np.zeros(CODE_BYTES, np.float32)]
)
def test_a_code_of_another_type_or_size_is_refused(wrong: npt.NDArray[np.generic]) -> None:
    view = RememberedView(frame=5, view_ns=5, code=Array.of(wrong))

    with pytest.raises(MessageError, match="remembered view 5: expected a uint8 code of 960"):
        PlaceRecognizer().restore([view])
