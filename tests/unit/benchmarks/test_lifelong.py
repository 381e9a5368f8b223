"""The lifelong benchmark: legs without end, and what cycles cost early and late."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.harness import CycleMeter, Mark
from benchmarks.lifelong.courier import LEG_NS, STOPS, Courier
from benchmarks.lifelong.measure import SPAN, drive
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.nodes import ROOT_MAP, Goal, Map
from cogmap.schemas.sensing import Pose, Street, TruePose, TrueTown


def _town() -> TrueTown:
    street = Street(name="alley", line_m=[(0.0, 0.0), (200.0, 0.0)], width_m=6.0)
    kerbs_m = np.array([[0.0, -4.0, 200.0, -4.0]], np.float32)
    return TrueTown(seed=1, streets=[street], buildings=[], kerbs_m=Array.of(kerbs_m))


def _pose(stamp_ns: int) -> TruePose:
    here = Pose(x_m=1.0, y_m=0.0, heading_rad=0.0)
    return TruePose(stamp_ns=stamp_ns, pose=here, travelled_m=0.0, progress=0.0)


def _goals(messages: list[Message]) -> list[Goal]:
    found = []
    for message in messages:
        assert isinstance(message, Offer)
        found += [each for each in message.operations if isinstance(each, Goal)]
    return found


def _driven(courier: Courier, legs: int) -> list[tuple[float, float]]:
    """The places of so many legs, each reached at once."""
    places = []
    for number in range(legs):
        (goal,) = _goals(courier.on_pose(_pose(number)))
        places.append((goal.x_m, goal.y_m))
        courier.graph.change([Goal(id=goal.id, x_m=goal.x_m, y_m=goal.y_m, reached_ns=number)])
    return places


def _courier() -> Courier:
    courier = Courier(seed=1)
    courier.graph.change([Map(id=ROOT_MAP, cell_m=1.0)])
    courier.on_town(_town())
    return courier


def test_every_other_lap_takes_the_same_places_in_another_order_and_one_more() -> None:
    courier = _courier()
    first = _driven(courier, STOPS)
    second = _driven(courier, STOPS + 1)
    third = _driven(courier, STOPS)

    assert third == first
    assert set(first) < set(second)
    assert second[1:] != first
    assert courier.laps == 2


def test_a_place_that_is_not_reached_in_time_is_given_up() -> None:
    courier = _courier()
    (first,) = _goals(courier.on_pose(_pose(0)))
    courier.graph.change([first])

    assert courier.on_pose(_pose(LEG_NS)) == []
    (second,) = _goals(courier.on_pose(_pose(LEG_NS + 1)))
    assert second.id != first.id


def test_costs_are_those_of_the_cycles_between_two() -> None:
    meter = CycleMeter()
    cheap = [Mark(float(number), 10 * number) for number in range(SPAN + 1)]
    last = cheap[-1]
    dear = [Mark(last.cpu_s + 3 * n, last.message_bytes + 40 * n) for n in range(1, SPAN + 1)]
    meter.marks = [*cheap, *dear]

    assert meter.spent(0, SPAN) == (1.0, 10.0)
    assert meter.spent(SPAN, 2 * SPAN) == (3.0, 40.0)


def test_a_short_drive_is_measured() -> None:
    metrics = drive(30, lambda share: None, early_at=15)

    assert metrics["travelled_m"] > 1.0
    assert metrics["log_bytes_late"] > 0.0
    assert math.isfinite(metrics["cycle_ratio"])
