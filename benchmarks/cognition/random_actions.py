"""An agent that acts at random, the baseline of survival."""

from __future__ import annotations

import math

import numpy as np

from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import Action, ActionName, Behaviours

TURNS_RAD = (-math.pi / 2, math.pi / 2)


class RandomActions:
    """In the place of action selection: each broadcast is answered with any action that the agent
    is able to take then, be it called for or not.
    """

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng([seed, 0xAC])

    def module(self) -> Module:
        """Return the module to run in the place of `action`."""
        return Module("action").on(topics.BEHAVIOURS, self.on_behaviours, emits=[topics.ACTION])

    def on_behaviours(self, behaviours: Behaviours) -> Action:
        """Draw any of the actions that can be taken, which to halt and to turn always can."""
        able: list[tuple[str, dict[str, Scalar]]] = [(ActionName.HALT, {})]
        for turn_rad in TURNS_RAD:
            able.append((ActionName.TURN, {"turn_rad": turn_rad}))
        for behaviour in behaviours.behaviours:
            if not behaviour.rejection and behaviour.action != ActionName.HALT:
                able.append((behaviour.action, behaviour.parameters))

        action, parameters = able[int(self._rng.integers(len(able)))]
        return Action(
            stamp_ns=behaviours.stamp_ns,
            cycle=behaviours.cycle,
            scheme=action,
            action=action,
            activation=1.0,
            parameters=parameters,
            behaviours=behaviours.behaviours,
        )
