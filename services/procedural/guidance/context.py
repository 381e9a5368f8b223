"""How well a guidance scheme fits what is conscious, and the behaviour that it becomes. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import ActionName, Behaviour, GuidanceScheme, Relation
from cogmap.services.procedural.guidance.alignment import Motion, aligned, pairs_of

# So far from where it was learned, or turned so far, a scheme is half as active.
HALF_AWAY_M = 4.0
HALF_TURNED_RAD = 0.5
# Nothing is known yet: as likely a success as not.
UNTRIED = 0.5
# How much it counts to come to the end of a path, as in the adding list of a scheme.
SALIENCE = 0.3
# Fewer landmarks count as so many, the others missing.
MIN_LANDMARKS = 3
SEEN_NS = "seen_ns"
RESULT = "self at the end of the path"


def reliability(scheme: GuidanceScheme) -> float:
    """Compute the share of its executions that were successes, UNTRIED before the first."""
    if not scheme.executions:
        return UNTRIED
    return scheme.successes / scheme.executions


class Fit(NamedTuple):
    """A scheme in a situation: how active each of its landmarks is, in words, how active they are
    together, and the motion that brings its landmarks and its path to where they are now.
    """

    scheme: GuidanceScheme
    context: Mapping[str, float]
    activation: float
    motion: Motion

    @property
    def rank(self) -> tuple[float, float, str]:
        """Return the key that orders schemes as they come to mind."""
        return -self.activation, -reliability(self.scheme), self.scheme.name

    def behaviour(self, seen_ns: int) -> Behaviour:
        """Make the behaviour that the scheme becomes by a view of that stamp."""
        scheme = self.scheme
        parameters: dict[str, Scalar] = {SEEN_NS: seen_ns}
        for number, path_m in enumerate(scheme.path_m, start=1):
            place_m = self.motion.moved(complex(*path_m))
            parameters[f"ahead_{number}_m"] = place_m.real
            parameters[f"left_{number}_m"] = place_m.imag

        return Behaviour(
            scheme=scheme.name,
            activation=min(1.0, self.activation + SALIENCE),
            action=ActionName.GUIDE,
            parameters=parameters,
            context=dict(self.context),
            adding={RESULT: SALIENCE},
            reliability=reliability(scheme),
            executions=scheme.executions,
            successes=scheme.successes,
        )


def fit(
    scheme: GuidanceScheme, relations: Mapping[str, Relation], activations: Mapping[str, float]
) -> Fit | None:
    """Fit a scheme to the `relations` to objects, by their ids; None if it does not fit.

    Each landmark is as active as its object, but the less the farther the agent is from where it
    learned the scheme: half as much at HALF_AWAY_M, or HALF_TURNED_RAD. A missing landmark is not
    active, and fewer than MIN_LANDMARKS count as that many, the others missing.
    """
    pairs = pairs_of(scheme.landmarks, list(relations.values()))
    found = aligned(pairs)
    if found is None:
        return None

    motion, agreeing = found
    names = list(relations)
    away = abs(motion.origin_before()) / HALF_AWAY_M
    turned = motion.turn_rad / HALF_TURNED_RAD
    closeness = 1.0 / (1.0 + away**2 + turned**2)
    context = {_spelled(landmark): 0.0 for landmark in scheme.landmarks}
    for pair in agreeing:
        landmark = scheme.landmarks[pair.number]
        context[_spelled(landmark)] = closeness * activations.get(names[pair.seen], 0.0)

    activation = sum(context.values()) / max(MIN_LANDMARKS, len(scheme.landmarks))
    return Fit(scheme, context, activation, motion)


def end_of(parameters: Mapping[str, Scalar]) -> complex | None:
    """Return the last place of the path that parameters have; None if they have no path."""
    last = len(parameters) // 2
    ahead_m = parameters.get(f"ahead_{last}_m")
    left_m = parameters.get(f"left_{last}_m")
    if not isinstance(ahead_m, int | float) or not isinstance(left_m, int | float):
        return None
    return complex(ahead_m, left_m)


def _spelled(landmark: Relation) -> str:
    """Spell a landmark in words."""
    degrees = math.degrees(landmark.bearing_rad)
    return f"{landmark.look} at {landmark.range_m:.0f} m, {degrees:+.0f} degrees"
