"""Places are recognised by the views that lead to them, in another light, at another speed, looking
a little aside.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from cogmap.errors import MessageError
from schemas.array import Array
from schemas.sensing import PlaceMatch, RememberedView
from services.epam.places.descriptor import DESCRIPTOR_BYTES
from services.epam.places.recognizer import PlaceConfig, PlaceRecognizer

Image = npt.NDArray[np.uint8]
HEIGHT = 240
WIDTH = 320
WAY = 60
NEAR = np.full((HEIGHT, WIDTH), 10.0, np.float32)


class Way:
    """A way whose views, at every place from 0 to WAY, go over into one another."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        coarse = rng.uniform(30, 220, (WAY // 2 + 2, 9, 12, 3)).astype(np.float32)
        self._pictures = [cv2.resize(picture, (WIDTH + 40, HEIGHT)) for picture in coarse]

    def view(self, place: float, aside_px: int = 0, evening: bool = False) -> Image:
        """What is seen at `place`, by a robot that looks a little aside."""
        before, share = divmod(place / 2, 1.0)
        both = self._pictures[int(before)] * (1 - share) + self._pictures[int(before) + 1] * share
        picture = both[:, 20 + aside_px : 20 + aside_px + WIDTH] / 255
        if evening:
            picture = 0.6 * picture**1.2 * np.array([1.1, 1.0, 0.85])
        noise = np.random.default_rng(int(1000 * place)).normal(0, 0.01, picture.shape)
        return np.asarray(np.clip(255 * (picture + noise), 0, 255), np.uint8)


def _drive(
    memory: PlaceRecognizer, views: list[Image], first: int = 0
) -> tuple[list[PlaceMatch | None], list[RememberedView]]:
    matches: list[PlaceMatch | None] = []
    remembered = []
    for number, image in enumerate(views, first):
        found, new = memory.observe(number, 200_000_000 * number, image, NEAR)
        assert len(found) <= 1
        matches.append(found[0] if found else None)
        remembered += new
    return matches, remembered


def _lap(way: Way) -> list[Image]:
    return [way.view(place) for place in range(WAY)]


def _memory_of(way: Way) -> PlaceRecognizer:
    memory = PlaceRecognizer()
    _drive(memory, _lap(way))
    return memory


def test_a_way_is_recognised_in_another_light_at_another_speed_and_with_a_turned_head() -> None:
    way = Way(1)
    memory = _memory_of(way)
    places = np.arange(0, WAY - 30, 1.4)
    matches, _ = _drive(memory, [way.view(place, 10, evening=True) for place in places], WAY)
    errors = [
        abs(match.frame - place) for match, place in zip(matches, places, strict=True) if match
    ]
    assert len(errors) >= 0.8 * len(places)
    assert max(errors) <= 2.0
    assert all(
        match.score >= 0.9 and match.view_ns == 200_000_000 * match.frame
        for match in matches
        if match
    )


def test_on_a_way_never_gone_nothing_matches_and_every_view_is_remembered() -> None:
    memory = _memory_of(Way(1))
    matches, remembered = _drive(memory, _lap(Way(2)), WAY)
    assert not any(matches)
    assert [view.frame for view in remembered] == list(range(WAY, 2 * WAY))


def test_one_look_alone_is_no_match() -> None:
    way = Way(1)
    other = Way(2)
    memory = _memory_of(way)
    elsewhere = [other.view(place) for place in range(20)]
    matches, _ = _drive(memory, [*elsewhere[:10], way.view(15), *elsewhere[10:]], WAY)
    assert not any(matches)


def test_the_views_just_seen_are_no_match() -> None:
    way = Way(1)
    there = [way.view(place) for place in range(12)]
    matches, _ = _drive(PlaceRecognizer(), [*there, *there])
    assert not any(matches)


def test_a_place_that_is_recognised_is_not_remembered_anew() -> None:
    way = Way(1)
    memory = _memory_of(way)
    matches, remembered = _drive(
        memory, [way.view(place, evening=True) for place in range(30)], WAY
    )
    assert len(remembered) == sum(match is None for match in matches) <= 6


def test_a_robot_at_rest_remembers_one_view() -> None:
    memory = PlaceRecognizer()
    rng = np.random.default_rng(0)
    image = Way(1).view(3).astype(np.int16)
    noisy = [
        np.clip(image + rng.normal(0, 5, image.shape), 0, 255).astype(np.uint8) for _ in range(20)
    ]
    _, remembered = _drive(memory, noisy)
    assert len(remembered) == 1


def test_at_rest_the_last_match_stands() -> None:
    way = Way(1)
    memory = _memory_of(way)
    matches, _ = _drive(memory, [way.view(place) for place in (5, 6, 7, 8, 9, 10, 10, 10)], WAY)
    assert matches[-1] is not None
    assert matches[-3] == matches[-2] == matches[-1]


@pytest.mark.parametrize(
    ("image", "depth_m"),
    [
        (np.zeros((HEIGHT, WIDTH, 3), np.uint8), NEAR),
        (np.full((HEIGHT, WIDTH, 3), 140, np.uint8), NEAR),
        (Way(1).view(4), np.zeros_like(NEAR)),
        (Way(1).view(4), NEAR + 100),
    ],
    ids=["black", "blank", "of no known depth", "of what is far off alone"],
)
def test_a_view_that_shows_no_place_is_neither_remembered_nor_matched(
    image: Image, depth_m: npt.NDArray[np.float32]
) -> None:
    way = Way(1)
    memory = _memory_of(way)
    matches, _ = _drive(memory, [way.view(place) for place in range(10)], WAY)
    assert matches[-1] is not None
    assert memory.observe(99, 99, image, depth_m) == ([], [])


def test_what_was_remembered_before_a_restart_is_recognised_after_it() -> None:
    way = Way(1)
    memory = _memory_of(way)
    restarted = PlaceRecognizer()
    for view in memory.all:
        restarted.restore([view])
    assert list(restarted.all) == list(memory.all)
    again = [way.view(place, evening=True) for place in range(30)]
    matches, _ = _drive(restarted, again, WAY)
    assert [match.frame for match in matches[5:] if match] == list(range(5, 30))


def test_of_too_many_views_the_oldest_are_forgotten_and_the_others_known_still() -> None:
    first = Way(1)
    second = Way(2)
    third = Way(3)
    memory = PlaceRecognizer(PlaceConfig(capacity=150))
    _drive(memory, [*_lap(first), *_lap(second), *_lap(third)])
    kept = [view.frame for view in memory.all]
    assert len(kept) <= 150
    assert kept == list(range(kept[0], 3 * WAY))
    assert not any(_drive(memory, [first.view(place) for place in range(20)], 200)[0])
    assert any(_drive(memory, [third.view(place) for place in range(20)], 300)[0])


def test_the_same_views_give_the_same_answers() -> None:
    way = Way(1)
    views = [*_lap(way), *(way.view(place, 6, evening=True) for place in range(20))]
    assert _drive(PlaceRecognizer(), views) == _drive(PlaceRecognizer(), views)


@pytest.mark.parametrize(
    "code", [np.zeros(DESCRIPTOR_BYTES - 1, np.uint8), np.zeros(DESCRIPTOR_BYTES, np.float32)]
)
def test_a_code_of_another_kind_is_refused(code: npt.NDArray[np.generic]) -> None:
    with pytest.raises(MessageError, match="remembered view 5: expected a uint8 code of 384"):
        PlaceRecognizer().restore([RememberedView(frame=5, view_ns=5, code=Array.of(code))])
