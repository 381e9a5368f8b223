"""What a person wishes of a running system."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.cli.dashboard.live import message_for
from cogmap.cli.dashboard.source import Wish
from cogmap.errors import UsageError
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode
from cogmap.schemas.nodes import Goal
from cogmap.schemas.process import Pause
from cogmap.schemas.sensing import Reset, StreetClosure
from cogmap.testing import graph_of, landmark

GRAPH = graph_of(landmark("41a", [(3.0, 0.0)], names={"bakery": 5.0}), Goal(id="goal:home"))


def test_a_place_is_a_goal() -> None:
    offer, done = message_for(Wish(place=(12.5, -3.0)), GRAPH)

    assert isinstance(offer, Offer)
    (goal,) = offer.operations
    assert isinstance(goal, Goal)
    assert (goal.x_m, goal.y_m, goal.object) == (12.5, -3.0, "")
    assert done == "12.5,-3 is a goal now"


@pytest.mark.parametrize("name", ["bakery", "41a"])
def test_an_object_of_the_map_is_a_goal_by_its_name_or_label(name: str) -> None:
    offer, _ = message_for(Wish(goal=name), GRAPH)

    assert isinstance(offer, Offer)
    (goal,) = offer.operations
    assert isinstance(goal, Goal)
    assert goal.object == name


def test_what_is_not_on_the_map_is_refused_with_what_may_be_meant() -> None:
    with pytest.raises(UsageError, match="did you mean 'bakery'"):
        message_for(Wish(goal="bakry"), GRAPH)


def test_all_goals_are_forgotten() -> None:
    offer, _ = message_for(Wish(clear=True), GRAPH)

    assert isinstance(offer, Offer)
    assert offer.operations == [DropNode(id="goal:home")]


def test_the_robot_is_carried_back() -> None:
    reset, _ = message_for(Wish(resets=True), GRAPH)

    assert reset == Reset()


def test_a_street_is_closed_and_opened() -> None:
    for closed in (True, False):
        closure, _ = message_for(Wish(street="Elm Street 1", closed=closed), GRAPH)
        assert closure == StreetClosure(street="Elm Street 1", closed=closed)


@pytest.mark.parametrize(
    ("wish", "pause"),
    [
        (Wish(play=False), Pause(is_paused=True)),
        (Wish(play=True), Pause(is_paused=False)),
        (Wish(step=True), Pause(is_paused=True, views=1)),
    ],
)
def test_time_stands_passes_and_goes_on_by_a_view(wish: Wish, pause: Pause) -> None:
    asked, _ = message_for(wish, GRAPH)
    assert asked == pause


@pytest.mark.parametrize("wish", [Wish(), Wish(speed=2.0), Wish(seek_s=3.0)])
def test_a_running_system_has_no_other_time(wish: Wish) -> None:
    with pytest.raises(UsageError, match="no other time than now"):
        message_for(wish, GRAPH)


@pytest.mark.parametrize(
    "wish", [{"place": [1e300, 0]}, {"place": [1]}, {"goal": ""}, {"goal": 300 * "x"}, {"goal": 1}]
)
def test_a_goal_without_sense_is_no_wish(wish: dict[str, object]) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.json.decode(msgspec.json.encode(wish), type=Wish)
