"""Perceptual associative memory learns what is conscious together, and expects it again."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.schemas.cognition import Broadcast, Coalition, Trigger
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.nodes import Object, category_id, name_id
from cogmap.schemas.sensing import Associations
from cogmap.services.epam.association.graph import MAX_NODES, AssociativeGraph
from cogmap.services.epam.association.memory import MAX_WAITING, Primer, nodes_of
from cogmap.services.epam.association.prior import Prior
from cogmap.services.epam.config import Priming
from cogmap.testing import landmark

SECOND_NS = 1_000_000_000
CONFIG = Priming()


def _object(name: str, function: str = "", salience: float = 0.0, *, label: str = "41a") -> Object:
    return landmark(label, names={name: 1.0}, function=function, salience=salience)


def _broadcast(second: int, *nodes: Object, feeling: Feeling = Feeling.NONE) -> Broadcast:
    coalition = Coalition(codelet="test", activation=0.5, nodes=list(nodes), feeling=feeling)
    return Broadcast(
        stamp_ns=second * SECOND_NS,
        cycle=second,
        trigger=Trigger.ONE_COALITION,
        coalition=coalition,
    )


def _taught(*rounds: tuple[str, ...]) -> AssociativeGraph:
    graph = AssociativeGraph(CONFIG)
    for second, names in enumerate(rounds):
        graph.learn(list(names), second * SECOND_NS)
    return graph


def test_what_was_conscious_together_primes_one_another() -> None:
    graph = _taught(*[("a", "b"), ("c",)] * 10, ("a",))
    primed = graph.primed(20 * SECOND_NS)

    assert primed["b"] > primed["c"] > 0.0


def test_the_more_often_two_were_conscious_together_the_more_is_expected() -> None:
    few = _taught(*[("a", "b")] * 3)
    many = _taught(*[("a", "b")] * 30)

    assert many.primed(30 * SECOND_NS)["b"] > few.primed(3 * SECOND_NS)["b"]


def test_what_was_conscious_long_ago_primes_nothing() -> None:
    graph = _taught(*[("a", "b")] * 10)

    assert "b" in graph.primed(10 * SECOND_NS)
    assert graph.primed(3600 * SECOND_NS) == {}


def test_a_full_graph_gives_up_what_was_conscious_least() -> None:
    graph = AssociativeGraph(CONFIG)
    for number in range(MAX_NODES):
        graph.learn(["known", f"building-{number}"], number * SECOND_NS)
    graph.learn(["known", "new"], MAX_NODES * SECOND_NS)
    names = graph.published().names

    assert len(names) == MAX_NODES
    assert {"known", "new"} <= {*names}


def test_a_restored_graph_expects_the_same() -> None:
    graph = _taught(*[("a", "b"), ("b", "c")] * 10)
    encoded = msgspec.msgpack.encode(graph.published())
    again = AssociativeGraph(CONFIG)
    again.restore(msgspec.msgpack.decode(encoded, type=Associations))

    before, after = graph.primed(21 * SECOND_NS), again.primed(21 * SECOND_NS)
    assert after == pytest.approx(before)
    again.learn(["a", "c"], 22 * SECOND_NS)
    graph.learn(["a", "c"], 22 * SECOND_NS)
    assert again.primed(22 * SECOND_NS) == pytest.approx(graph.primed(22 * SECOND_NS), abs=1e-2)


def test_a_graph_whose_parts_do_not_fit_is_refused() -> None:
    whole = _taught(*[("a", "b", "c")] * 3).published()
    other = _taught(("a",), ("a", "b")).published()
    unnamed = msgspec.structs.replace(whole, names=whole.names[:-1])
    unended = msgspec.structs.replace(whole, targets=other.targets)
    beyond = msgspec.structs.replace(
        other, sources=whole.sources, targets=whole.targets, weights=whole.weights
    )

    for broken in (unnamed, unended, beyond):
        with pytest.raises(MessageError, match="associations of"):
            AssociativeGraph(CONFIG).restore(broken)


def test_what_is_conscious_are_objects_by_their_look_and_their_categories() -> None:
    broadcast = _broadcast(1, _object("bakery", "shop"), _object("bakery", "shop", label="52b"))

    assert nodes_of(broadcast) == [name_id("bakery"), category_id("shop")]


def test_an_object_that_is_missed_is_not_learned() -> None:
    gone = _object("bakery", salience=-1.0)

    assert name_id("bakery") not in nodes_of(_broadcast(1, gone, feeling=Feeling.SURPRISE))
    assert name_id("bakery") in nodes_of(_broadcast(1, gone, feeling=Feeling.DANGER))


def test_a_view_is_not_primed_by_what_came_after_the_view_before_the_last() -> None:
    primer = Primer(CONFIG)
    for second in range(1, 6):
        primer.begin(second * SECOND_NS)
        primer.on_broadcast(_broadcast(second, _object("a"), _object("b")))

    early = Primer(CONFIG)
    for second in range(1, 6):
        early.begin(second * SECOND_NS)
        if second < 5:
            early.on_broadcast(_broadcast(second, _object("a"), _object("b")))

    assert primer.begin(6 * SECOND_NS) == early.begin(6 * SECOND_NS)
    assert primer.prior(6 * SECOND_NS) == early.prior(6 * SECOND_NS)
    assert primer.prior(6 * SECOND_NS).primed


def test_without_views_no_more_than_the_newest_broadcasts_are_kept() -> None:
    primer = Primer(CONFIG)
    count = 1000
    for second in range(count):
        primer.on_broadcast(_broadcast(second, _object(f"building-{second}")))

    for second in range(count, count + 3):
        primer.begin(second * SECOND_NS)

    learned = set(primer.published().names)
    newest = range(count - MAX_WAITING, count)
    assert learned == {name_id(f"building-{second}") for second in newest}


def test_a_view_is_ready_once_the_competition_that_primes_it_has_ended() -> None:
    primer = Primer(CONFIG)
    primer.begin(1 * SECOND_NS)
    assert primer.is_ready
    primer.begin(2 * SECOND_NS)
    assert not primer.is_ready

    primer.on_competition(1 * SECOND_NS)
    assert primer.is_ready


def test_the_graph_is_published_after_so_many_broadcasts() -> None:
    primer = Primer(CONFIG, broadcasts_per_publication=2)
    published = []
    for second in range(1, 8):
        published.append(primer.begin(second * SECOND_NS) is not None)
        primer.on_broadcast(_broadcast(second, _object("a")))

    assert published == [False, False, False, True, False, True, False]


def test_a_prior_makes_what_is_primed_likelier_and_the_rest_no_less_likely() -> None:
    prior = Prior({name_id("bakery"): 0.4}, share=0.5)
    bakery, clinic = prior.log_ratio(["bakery", "clinic"]).tolist()

    assert bakery > clinic == 0.0


def test_however_much_is_primed_it_has_no_more_than_its_share() -> None:
    labels = ["bakery", "clinic", "school"]
    primed = {name_id(label): 0.9 for label in labels}
    ratios = np.exp(Prior(primed, share=0.5).log_ratio(labels))

    assert ratios.mean() == pytest.approx(1.5)


def test_where_nothing_is_primed_all_is_as_likely_as_without() -> None:
    assert Prior({}, share=0.5).log_ratio(["bakery", "clinic"]).tolist() == [0.0, 0.0]
    assert Prior({"object:other": 0.5}, share=0.5).log_ratio(["bakery"]).tolist() == [0.0]
