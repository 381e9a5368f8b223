"""What was conscious with a feeling is felt about again when it is perceived."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.schemas.cognition import Broadcast, Coalition, Trigger
from cogmap.schemas.feelings import Feeling, salience_of
from cogmap.schemas.nodes import Object, feeling_id
from cogmap.schemas.sensing import Associations
from cogmap.services.epam.association.graph import MAX_NODES, AssociativeGraph
from cogmap.services.epam.association.memory import BEHIND, Primer
from cogmap.services.epam.config import Priming
from cogmap.testing import landmark, percept

SECOND_NS = 1_000_000_000
CONFIG = Priming()


def _object(name: str, function: str = "", *, label: str = "41a") -> Object:
    return landmark(label, names={name: 1.0}, function=function)


class Story:
    """A PAM that learns from a broadcast a second."""

    def __init__(self) -> None:
        self.primer = Primer(CONFIG, broadcasts_per_publication=1)
        self.published: list[Associations] = []
        self._second = 0

    def tell(self, *nodes: Object, feeling: Feeling = Feeling.NONE, times: int = 1) -> None:
        """So many broadcasts, and the views after which they are learned from."""
        for _ in range(times):
            self._second += 1
            coalition = Coalition(
                codelet="test", activation=0.5, nodes=list(nodes), feeling=feeling
            )
            told = Broadcast(
                stamp_ns=self._second * SECOND_NS,
                cycle=self._second,
                trigger=Trigger.ONE_COALITION,
                coalition=coalition,
            )
            self.primer.on_broadcast(told)
            self._view()

        for _ in range(BEHIND):
            self._second += 1
            self._view()

    def feelings(self, label: str, function: str = "", activation: float = 1.0) -> list[Feeling]:
        """What is felt about a percept."""
        seen = percept(label, activation=activation, function=function)
        return list(self.primer.felt(seen).feelings)

    def salience(self, label: str) -> float:
        """How much a percept of that label matters."""
        return self.primer.felt(percept(label, activation=1.0)).salience

    def _view(self) -> None:
        associations = self.primer.begin(self._second * SECOND_NS)
        if associations is not None:
            self.published.append(associations)


@pytest.mark.parametrize("feeling", [feeling for feeling in Feeling if feeling])
def test_what_was_conscious_with_a_feeling_is_felt_about_again(feeling: Feeling) -> None:
    story = Story()
    story.tell(_object("bakery"), feeling=feeling)
    story.tell(_object("tower"))

    assert story.feelings("bakery") == [feeling]
    assert story.feelings("tower") == []


def test_danger_is_bad_and_what_is_needed_is_good() -> None:
    story = Story()
    story.tell(_object("bridge"), feeling=Feeling.DANGER)
    story.tell(_object("charger"), feeling=Feeling.NEED)

    assert story.salience("bridge") < 0 < story.salience("charger")
    assert story.salience("tower") == 0.0


def test_the_more_often_a_feeling_came_the_more_an_object_matters() -> None:
    once = Story()
    once.tell(_object("bridge"), feeling=Feeling.DANGER)
    often = Story()
    often.tell(_object("bridge"), feeling=Feeling.DANGER, times=3)

    assert often.salience("bridge") < once.salience("bridge")


def test_a_feeling_that_does_not_come_again_is_unlearned_slowly_and_novelty_at_once() -> None:
    story = Story()
    story.tell(_object("bridge"), feeling=Feeling.DANGER, times=2)
    story.tell(_object("bridge"), feeling=Feeling.NOVELTY, times=2)
    story.tell(_object("bridge"), times=3)
    assert story.feelings("bridge") == [Feeling.DANGER]

    story.tell(_object("bridge"), times=100)
    assert story.feelings("bridge") == []


def test_what_is_long_out_of_sight_keeps_its_feelings() -> None:
    story = Story()
    story.tell(_object("bridge"), feeling=Feeling.DANGER)
    before = story.salience("bridge")
    story.tell(_object("tower"), times=100)

    assert story.salience("bridge") == before


def test_what_is_perceived_dimly_is_felt_about_less() -> None:
    story = Story()
    story.tell(_object("bridge"), feeling=Feeling.DANGER)

    assert story.feelings("bridge", activation=0.9) == [Feeling.DANGER]
    assert story.feelings("bridge", activation=0.3) == []


def test_an_object_that_was_never_conscious_is_felt_about_as_its_category() -> None:
    story = Story()
    story.tell(_object("charger", "charge"), feeling=Feeling.NEED)

    assert story.feelings("other", "charge") == [Feeling.NEED]
    story.tell(_object("other"))
    assert story.feelings("other", "charge") == []


def test_individuals_of_one_look_are_felt_about_alike() -> None:
    story = Story()
    story.tell(_object("bakery", label="52b"), feeling=Feeling.DANGER)

    assert story.feelings("bakery") == [Feeling.DANGER]


def test_a_feeling_changes_neither_evidence_nor_activation_nor_what_is_primed() -> None:
    felt = Story()
    felt.tell(_object("bridge"), _object("tower"), feeling=Feeling.DANGER, times=5)
    calm = Story()
    calm.tell(_object("bridge"), _object("tower"), times=5)
    seen = percept("bridge", activation=0.9, evidence=0.7)
    again = felt.primer.felt(seen)
    labels = ["bridge", "tower", "other"]
    ratios, calm_ratios = (
        story.primer.prior(6 * SECOND_NS).log_ratio(labels).tolist() for story in (felt, calm)
    )

    assert msgspec.structs.replace(again, feelings={}) == seen
    assert ratios == calm_ratios
    assert ratios[0] > ratios[2]


def test_feelings_are_published_as_nodes_and_known_after_a_restart() -> None:
    story = Story()
    story.tell(_object("bridge"), feeling=Feeling.DANGER)
    kept = story.published[-1]
    again = Story()
    again.primer.restore(msgspec.msgpack.decode(msgspec.msgpack.encode(kept), type=Associations))

    assert feeling_id(Feeling.DANGER) in kept.names
    assert again.salience("bridge") == story.salience("bridge") != 0.0


def test_a_full_graph_gives_up_no_feeling() -> None:
    graph = AssociativeGraph(CONFIG)
    graph.learn(["bridge", feeling_id(Feeling.DANGER)], 0)
    for number in range(2 * MAX_NODES):
        graph.learn([f"building-{number}"] * 2, number * SECOND_NS)

    names = graph.published().names
    assert feeling_id(Feeling.DANGER) in names
    assert "bridge" not in names


def test_of_several_feelings_the_strongest_decides_how_much_something_matters() -> None:
    assert salience_of({}) == 0.0
    assert salience_of({Feeling.NOVELTY: 0.4, Feeling.DANGER: 0.6}) == -0.6
    assert salience_of({Feeling.DANGER: 0.4, Feeling.NEED: 0.6}) == 0.6
    assert salience_of({Feeling.LOST: 0.5, Feeling.NOVELTY: 0.5}) == 0.5
