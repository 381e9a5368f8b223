"""Relations are nodes of perceptual associative memory: what stood in one is expected in it."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.schemas.cognition import Broadcast, Coalition, Relation, Trigger
from cogmap.schemas.nodes import (
    ROOT_MAP,
    Side,
    category_id,
    map_id,
    name_id,
    object_id,
    relation_id,
)
from cogmap.schemas.sensing import Associations
from cogmap.services.epam.association.memory import BEHIND, Primer, nodes_of
from cogmap.services.epam.association.prior import Prior
from cogmap.services.epam.association.relations import NamedObject, beside, related
from cogmap.services.epam.config import Priming
from cogmap.testing import landmark

SECOND_NS = 1_000_000_000
CONFIG = Priming()
LEFT_OF_BAKERY = relation_id(Side.LEFT_OF, "bakery")
RIGHT_OF_SCHOOL = relation_id(Side.RIGHT_OF, "school")
RIGHT_OF_BAKERY = relation_id(Side.RIGHT_OF, "bakery")


def _seen_so(*looks: str) -> dict[str, Relation]:
    """The relations to the agent of what stands before it from left to right."""
    relations = {}
    for number, look in enumerate(looks):
        relations[object_id(look)] = Relation(look=look, range_m=10.0, bearing_rad=-0.2 * number)
    return relations


def _broadcast(second: int, *looks: str, maps: tuple[str, ...] = ()) -> Broadcast:
    nodes = [landmark(look) for look in looks]
    coalition = Coalition(
        codelet="test",
        activation=0.5,
        nodes=[*nodes],
        maps=list(maps),
        relations=_seen_so(*looks),
    )
    return Broadcast(
        stamp_ns=second * SECOND_NS,
        cycle=second,
        trigger=Trigger.ONE_COALITION,
        coalition=coalition,
    )


def _taught(*rounds: tuple[str, ...]) -> tuple[Primer, Associations]:
    """A PAM that has learned from a broadcast a second of what stood from left to right."""
    primer = Primer(CONFIG, broadcasts_per_publication=1)
    published = None
    for second, looks in enumerate(rounds, start=1):
        primer.on_broadcast(_broadcast(second, *looks))
        published = primer.begin(second * SECOND_NS) or published
    for second in range(len(rounds) + 1, len(rounds) + 1 + BEHIND):
        published = primer.begin(second * SECOND_NS) or published

    assert published is not None
    return primer, published


def _expected(primer: Primer, relation: str) -> dict[str, float]:
    """What is primed where that relation is active, long after the last broadcast."""
    prior = primer.prior(3600 * SECOND_NS)
    return dict(prior.where({relation: 1.0}).primed)


def test_neighbours_in_a_broadcast_stand_left_and_right_of_each_other() -> None:
    assert related(_seen_so("school", "bakery", "clinic").values()) == {
        RIGHT_OF_SCHOOL: name_id("bakery"),
        LEFT_OF_BAKERY: name_id("school"),
        RIGHT_OF_BAKERY: name_id("clinic"),
        relation_id(Side.LEFT_OF, "clinic"): name_id("bakery"),
    }


def test_what_stood_left_of_a_building_is_expected_there_and_not_on_its_right() -> None:
    primer, _ = _taught(*[("school", "bakery")] * 10)

    assert _expected(primer, LEFT_OF_BAKERY)[name_id("school")] > 0.5
    assert _expected(primer, RIGHT_OF_BAKERY) == {}


def test_of_two_that_stood_there_the_one_of_late_is_expected_more() -> None:
    primer, _ = _taught(*[("school", "bakery")] * 10, *[("clinic", "bakery")] * 10)
    expected = _expected(primer, LEFT_OF_BAKERY)

    assert expected[name_id("clinic")] > expected[name_id("school")] > 0.0


def test_what_has_no_name_stands_beside_nothing() -> None:
    assert related(_seen_so("school", "", "clinic").values()) == {
        RIGHT_OF_SCHOOL: name_id("clinic"),
        relation_id(Side.LEFT_OF, "clinic"): name_id("school"),
    }


def test_a_relation_is_not_unlearned_while_it_is_out_of_view() -> None:
    seen, _ = _taught(*[("school", "bakery")] * 10)
    later, _ = _taught(*[("school", "bakery")] * 10, *[("clinic", "tower")] * 30)

    assert _expected(later, LEFT_OF_BAKERY) == pytest.approx(_expected(seen, LEFT_OF_BAKERY))


def test_a_relation_is_a_node_that_is_published_and_restored_with_its_links() -> None:
    primer, published = _taught(*[("school", "bakery")] * 10)
    again = Primer(CONFIG, broadcasts_per_publication=1)
    again.restore(msgspec.msgpack.decode(msgspec.msgpack.encode(published), type=Associations))

    assert LEFT_OF_BAKERY in published.names
    assert _expected(again, LEFT_OF_BAKERY) == pytest.approx(_expected(primer, LEFT_OF_BAKERY))


def test_a_broadcast_alone_primes_nothing_over_a_relation() -> None:
    primer, _ = _taught(*[("school", "bakery")] * 10)
    by_time = Prior(primer.prior(12 * SECOND_NS).primed, CONFIG.share)

    assert by_time.primed
    assert all(not name.startswith("relation:") for name in by_time.primed)


def test_something_seen_stands_beside_the_nearest_that_are_named() -> None:
    named = {
        "tower": NamedObject(column=10.0, evidence=0.9),
        "school": NamedObject(column=80.0, evidence=0.8),
        "bakery": NamedObject(column=200.0, evidence=0.7),
    }

    assert beside(120.0, named) == {
        RIGHT_OF_SCHOOL: 0.8,
        LEFT_OF_BAKERY: 0.7,
    }
    assert beside(300.0, named) == {RIGHT_OF_BAKERY: 0.7}
    assert beside(300.0, {}) == {}


def test_the_less_evidence_there_is_of_a_building_the_less_is_expected_beside_it() -> None:
    prior = Prior(share=0.5, related={LEFT_OF_BAKERY: {name_id("school"): 0.8}})
    sure = prior.where({LEFT_OF_BAKERY: 1.0}).log_ratio(["school", "clinic"])
    unsure = prior.where({LEFT_OF_BAKERY: 0.1}).log_ratio(["school", "clinic"])

    assert sure[0] > unsure[0] > 0.0
    assert sure[1] == unsure[1] == 0.0


def test_a_sub_map_that_is_conscious_is_a_node_which_its_buildings_are_linked_with() -> None:
    primer = Primer(CONFIG, broadcasts_per_publication=1)
    district = map_id(3)
    told = _broadcast(1, "bakery", maps=(ROOT_MAP, district))

    assert nodes_of(told) == [name_id("bakery"), district]
    primer.on_broadcast(told)
    primer.on_broadcast(_broadcast(2, maps=(ROOT_MAP, district)))
    for second in range(1, 4 + BEHIND):
        primer.begin(second * SECOND_NS)
    assert name_id("bakery") in primer.prior(4 * SECOND_NS).primed


def test_categories_are_conscious_with_the_districts_of_what_has_them() -> None:
    node = landmark("bakery", function="shop")
    told = _broadcast(1, maps=(map_id(1),))
    coalition = msgspec.structs.replace(told.coalition, nodes=[node])

    assert nodes_of(msgspec.structs.replace(told, coalition=coalition)) == [
        name_id("bakery"),
        category_id("shop"),
        map_id(1),
    ]
