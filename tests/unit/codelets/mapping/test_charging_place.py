"""Where a need is eased the agent remembers that something eases it."""

from __future__ import annotations

from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import Need, Object, need_id, object_id
from cogmap.services.codelets.config import Config
from cogmap.testing import agent, graph_of, of_type, task
from tests.support.world.scenes import run

CONFIG = Config()
POST = object_id("1a")


def _need(*, is_eased: bool) -> Need:
    return Need(id=need_id("energy"), label="energy", level=0.5, is_eased=is_eased)


def _known(x_m: float, function: str = "charge") -> Object:
    return Object(id=POST, label="1a", function=function, x_m=x_m, y_m=0.0)


def _found(*nodes: Need | Object, **facts: float) -> list[Object]:
    answer = run(task("charging_place"), graph_of(agent(**facts), *nodes), CONFIG)
    return of_type(Object, answer.operations)


def test_where_the_battery_is_charged_there_is_a_charging_place() -> None:
    answer = run(task("charging_place"), graph_of(agent(), _need(is_eased=True)), CONFIG)
    (place,) = of_type(Object, answer.operations)
    (link,) = of_type(Link, answer.operations)

    assert (place.name, place.function, place.base_level) == ("charging-place", "charge", 1.0)
    assert link.source == place.id


def test_where_it_is_not_charged_there_is_none() -> None:
    assert _found(_need(is_eased=False)) == []
    assert _found() == []


def test_a_charging_place_that_is_known_is_not_remembered_again() -> None:
    assert _found(_need(is_eased=True), _known(3.0)) == []


def test_another_one_elsewhere_gets_a_label_of_its_own() -> None:
    (place,) = _found(_need(is_eased=True), _known(40.0))

    assert place.id != POST
    assert place.name == "charging-place"


def test_a_shop_charges_nothing() -> None:
    shop = Object(id=object_id("bakery"), label="bakery", function="shop", x_m=1.0, y_m=0.0)

    assert len(_found(_need(is_eased=True), shop)) == 1
