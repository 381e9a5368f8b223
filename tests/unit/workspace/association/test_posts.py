"""Posts without names that stand close together: which is which, and what waits to be told."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from cogmap.schemas.array import Array
from cogmap.schemas.nodes import Object, PathIntegration, Self, Sighting
from cogmap.schemas.sensing import Percept
from cogmap.services.workspace.association.individuals import Associated, Individuals
from cogmap.services.workspace.association.tracking import mapped, tracked
from cogmap.testing import agent, graph_of, landmark, percept_at, percepts, unidentified

STILL = Array.of(np.zeros((0, 5)))
ORIGIN = (0.0, 0.0, 0.0)
APART_M = 0.2


def _post(label: str, x_m: float, y_m: float, **facts: object) -> Object:
    """A post that was seen nine times, nobody knows by what name."""
    usual = {"names": {}, "sightings": 9, "x_sd_m": 0.02, "y_sd_m": 0.02}
    return landmark(label, [(x_m, y_m)], **(usual | facts))


def _sight(x_m: float, y_m: float, **facts: object) -> Percept:
    """A post as it is seen from the origin, exactly to a tenth of the distance between two."""
    usual = {"name": "", "evidence": 0.0, "width_m": 0.0}
    seen = percept_at(ORIGIN, "post", (x_m, y_m), bearing_sd_rad=0.01, range_sd_m=0.05)
    return unidentified(seen, **(usual | facts))


def _associated(known: Sequence[Object], *seen: Percept, looker: Self | None = None) -> Associated:
    individuals = Individuals(graph_of(looker or agent(), *known))
    individuals.known.restore()
    return individuals.labelled(percepts(0, *seen), STILL)


def _labels(found: Associated) -> list[str]:
    return [each.label for each in found.percepts.objects]


def _unsure(position_sd_m: float, heading_sd_rad: float, **facts: object) -> Self:
    """An agent at the origin that knows its pose so badly."""
    spread = [position_sd_m, position_sd_m, heading_sd_rad]
    samples = np.random.default_rng(3).normal(0.0, spread, (400, 3))
    sd = {"x_sd_m": position_sd_m, "y_sd_m": position_sd_m, "heading_sd_rad": heading_sd_rad}
    return agent(samples - samples.mean(axis=0), **(sd | facts))


def _pair(x_m: float, y_m: float) -> list[tuple[float, float]]:
    return [(x_m, y_m), (x_m, y_m + APART_M)]


def test_a_pair_of_strangers_is_not_taken_for_a_known_pair_that_stands_so_far_apart_too() -> None:
    known = [_post(f"{number}a", *at_m) for number, at_m in enumerate(_pair(5.0, 0.0))]
    strangers = [_sight(*at_m) for at_m in _pair(5.0, 3.5)]
    found = _associated(known, *strangers, looker=_unsure(0.3, 0.2))

    assert not set(_labels(found)) & {"0a", "1a"}


def test_a_pair_that_is_known_is_told_by_an_agent_that_knows_where_it_is() -> None:
    known = [_post(f"{number}a", *at_m) for number, at_m in enumerate(_pair(5.0, 0.0))]
    seen = [_sight(*at_m) for at_m in _pair(5.0, 0.0)]

    assert _labels(_associated(known, *seen)) == ["0a", "1a"]


def test_what_may_be_of_two_waits_and_states_its_place_as_badly_as_both_stand_apart() -> None:
    known = [_post(f"{number}a", *at_m) for number, at_m in enumerate(_pair(5.0, 0.0))]
    seen = _sight(5.0, APART_M / 2, bearing_sd_rad=0.05)
    found = _associated(known, seen)
    (waiting,) = found.waiting

    assert _labels(found) == []
    assert waiting.label in ("0a", "1a")
    assert waiting.certainty > 0.9
    # Half of it is of the other one.
    across_m2 = APART_M**2 / 2
    assert waiting.bearing_sd_rad == pytest.approx(math.hypot(0.05, across_m2**0.5 / 5.0), rel=0.05)
    assert waiting.range_sd_m == pytest.approx(seen.range_sd_m, rel=0.05)


def test_what_may_as_well_be_of_nothing_that_is_known_does_not_wait_for_anything() -> None:
    known = [_post("0a", 5.0, 0.0)]
    found = _associated(known, _sight(5.0, 0.35), looker=_unsure(0.05, 0.01))

    assert _labels(found) == []
    assert found.waiting == ()


@pytest.mark.parametrize("range_gain", [0.0, 0.05])
def test_posts_behind_each_other_are_told_apart_once_it_is_known_by_how_much_ranges_err(
    range_gain: float,
) -> None:
    known = [_post("0a", 5.0, 0.0), _post("1a", 5.25, 0.0)]
    seen = _sight(5.0 * (1 + range_gain), 0.0)
    found = _associated(known, seen, looker=agent(range_gain=range_gain))

    assert _labels(found) == ["0a"]
    assert found.percepts.objects[0].range_m == seen.range_m


def _seen_from_start(x_m: float, y_m: float) -> Sighting:
    return Sighting(
        x_m=x_m, y_m=y_m, range_sd_m=0.05, bearing_sd_rad=0.01, odometry=PathIntegration()
    )


def test_what_was_seen_a_moment_ago_is_told_however_lost_the_agent_is() -> None:
    first_m, second_m = _pair(5.0, 0.0)
    lost = _unsure(1.0, 0.4)
    by_map = [_post("0a", *first_m), _post("1a", *second_m)]
    tracked = [
        _post("0a", *first_m, last_sighting=_seen_from_start(*first_m)),
        _post("1a", *second_m, last_sighting=_seen_from_start(*second_m)),
    ]

    assert _labels(_associated(by_map, _sight(*first_m), looker=lost)) == []
    assert _labels(_associated(tracked, _sight(*first_m), looker=lost)) == ["0a"]


def test_what_was_seen_long_ago_stands_where_the_map_has_it() -> None:
    (first_m, second_m) = _pair(5.0, 0.0)
    node = _post("0a", *first_m, last_sighting=_seen_from_start(*second_m))
    drifted = agent(odometry=PathIntegration(variance_m2=1.0, variance_rad2=0.1))
    surely = np.zeros((3, 3))
    on_map = mapped([node])
    now = tracked([node], on_map, agent(), np.eye(3))
    later = tracked([node], on_map, drifted, surely)

    assert now.mean_m == pytest.approx(np.array([second_m]))
    assert later.mean_m == pytest.approx(np.array([first_m]))


def test_path_integration_leads_from_where_it_was_seen_to_where_it_is_seen_now() -> None:
    turned_rad = math.pi / 2
    here = PathIntegration(x_m=5.0, y_m=-5.0, heading_rad=turned_rad)
    known = [
        _post("0a", 0.0, 0.0, last_sighting=_seen_from_start(5.0, 0.0)),
        _post("1a", 0.3, 0.0, last_sighting=_seen_from_start(5.0, APART_M)),
    ]
    seen = (_sight(5.0, 0.0), _sight(5.0 + APART_M, 0.0))
    looker = _unsure(1.0, 0.4, odometry=here)

    assert _labels(_associated(known, *seen, looker=looker)) == ["0a", "1a"]
