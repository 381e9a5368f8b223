"""Behaviours to choose from."""

from __future__ import annotations

from typing import Any

from cogmap.schemas.cognition import Behaviour, Behaviours, Rejection


def behaviour(scheme: str, activation: float = 1.0, **facts: Any) -> Behaviour:
    """A behaviour that may be chosen, whose context is as active as it."""
    usual: dict[str, Any] = {"action": scheme, "context": {f"calls for {scheme}": activation}}
    return Behaviour(scheme=scheme, activation=activation, **(usual | facts))


def lacking(scheme: str, *missing: str, **facts: Any) -> Behaviour:
    """A scheme of whose context these patterns are missing."""
    rejection = Rejection.CONTEXT_MISSING
    context = dict.fromkeys(missing, 0.0)
    return behaviour(scheme, 0.0, rejection=rejection, context=context, **facts)


def behaviours_of(*behaviours: Behaviour, cycle: int = 1) -> Behaviours:
    """What procedural memory makes of the broadcast of a cycle."""
    return Behaviours(stamp_ns=cycle * 10**9, cycle=cycle, behaviours=[*behaviours])
