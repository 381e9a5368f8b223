"""Landmarks as they stand to the agent, guidance schemes, and what makes them conscious."""

from __future__ import annotations

import cmath
from typing import Any

from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import (
    Action,
    ActionName,
    Broadcast,
    Coalition,
    GuidanceScheme,
    Relation,
)
from cogmap.schemas.nodes import Object, PathIntegration, Self, object_id
from cogmap.testing import PERIOD_NS, agent

TOWN_M = {"bakery": 20 + 5j, "school": 25 - 8j, "library": 40 + 2j, "museum": 60 - 6j}
"""Where things stand, in metres, x + y x i."""


def relation(look: str, seen_m: complex) -> Relation:
    """Where something stands, metres ahead + metres left x i."""
    range_m, bearing_rad = cmath.polar(seen_m)
    return Relation(look=look, range_m=range_m, bearing_rad=bearing_rad)


def relations(at_m: complex = 0j, heading_rad: float = 0.0, *looks: str) -> dict[str, Relation]:
    """How the town, or what is named of it, stands to an agent, by id."""
    turned = cmath.rect(1.0, -heading_rad)
    return {
        object_id(look): relation(look, (TOWN_M[look] - at_m) * turned) for look in looks or TOWN_M
    }


def guidance(
    name: str = "guide_1", at_m: complex = 0j, *looks: str, **facts: Any
) -> GuidanceScheme:
    """A scheme that was learned there, and leads 10 m straight on."""
    usual: dict[str, Any] = {"path_m": [(0.0, 0.0), (10.0, 0.0)]}
    landmarks = list(relations(at_m, 0.0, *looks).values())
    return GuidanceScheme(name=name, landmarks=landmarks, **(usual | facts))


def driven(at_m: complex = 0j, heading_rad: float = 0.0, cycle: int = 1) -> Self:
    """An agent that has come there by path integration."""
    return agent(
        stamp_ns=cycle * PERIOD_NS,
        odometry=PathIntegration(x_m=at_m.real, y_m=at_m.imag, heading_rad=heading_rad),
    )


def broadcast(cycle: int, me: Self, seen: dict[str, Relation]) -> Broadcast:
    """The agent among what it sees."""
    objects = [
        Object(id=name, label=each.look, activation=1.0, x_m=0.0, y_m=0.0)
        for name, each in seen.items()
    ]
    coalition = Coalition(
        codelet="whereabouts", activation=0.5, nodes=[me, *objects], relations=seen
    )
    return Broadcast(stamp_ns=cycle * PERIOD_NS, cycle=cycle, trigger="t", coalition=coalition)


def selected(
    cycle: int,
    name: str = ActionName.FOLLOW_PLAN,
    scheme: str = "follow_route",
    parameters: dict[str, Scalar] | None = None,
) -> Action:
    """What was selected for the broadcast of a cycle."""
    return Action(
        stamp_ns=cycle * PERIOD_NS,
        cycle=cycle,
        scheme=scheme,
        action=name,
        activation=1.0,
        parameters=parameters or {},
    )
