"""Action selection as a module: behaviours compete, and one is chosen."""

from __future__ import annotations

from collections.abc import Iterable

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, Behaviours
from cogmap.services.action.behaviour_net import BehaviourNet
from cogmap.services.action.config import Config
from cogmap.services.action.selection import ActionSelection, MostActive, Selector

__all__ = ["ActionModule", "Config", "build"]


class ActionModule:
    """Answers the behaviours of each broadcast with the action that is chosen, or with none."""

    def __init__(self, config: Config) -> None:
        selector: Selector = MostActive()
        if config.selector == "behaviour_net":
            selector = BehaviourNet()
        threshold = config.selection_threshold
        self._selection = ActionSelection(selector, threshold, config.threshold_fall)
        self._last: Action | None = None
        self._resumed_cycle = -1

    def restore(self, past: Iterable[Message]) -> None:
        """Resume from the action that was published last."""
        for message in past:
            if isinstance(message, Action):
                self._last = message

        if self._last is not None:
            self._selection.restore(self._last)
            self._resumed_cycle = self._last.cycle

    def last(self) -> Action:
        """Return the action that was published last. Raises MessageError if none was."""
        if self._last is None:
            raise MessageError("no action was selected yet")
        return self._last

    def on_behaviours(self, behaviours: Behaviours) -> Action | None:
        """Select an action. None for behaviours that come again after a restart."""
        if behaviours.cycle <= self._resumed_cycle:
            return None

        self._resumed_cycle = -1
        selection = self._selection.select(behaviours.behaviours)
        chosen = selection.chosen
        self._last = Action(
            stamp_ns=behaviours.stamp_ns,
            cycle=behaviours.cycle,
            scheme="" if chosen is None else chosen.scheme,
            action="" if chosen is None else chosen.action,
            activation=0.0 if chosen is None else chosen.activation,
            parameters={} if chosen is None else chosen.parameters,
            behaviours=selection.considered,
            threshold=selection.threshold,
        )
        return self._last


def build(config: Config, instance: str) -> Module:
    """Build the module `action`."""
    action = ActionModule(config)
    return (
        Module("action", instance)
        .on(topics.BEHAVIOURS, action.on_behaviours, emits=[topics.ACTION])
        .journaling(topics.ACTION, action.restore, action.last, backfill=[topics.BEHAVIOURS])
    )
