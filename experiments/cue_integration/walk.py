"""One walk to the posts, and a return from there in each condition: trials of one number differ
only on the way back, so that what is the same in all is computed once.

Messages are handed over as they are, without a bus, and only those codelets run that a response
depends on: it is the same as with the bus and with all of them.
"""

from __future__ import annotations

import copy
import gc
from collections import deque
from collections.abc import Sequence

from cogmap.errors import CogmapError
from cogmap.experiments.cue_integration import agent, participant, room
from cogmap.experiments.cue_integration.trial import Condition, Response, Trial
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action
from cogmap.schemas.graph import Snapshot
from cogmap.schemas.process import Presence


class Walk:
    """A participant in its room: the modules, and the messages that have not been received yet."""

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._room = room.Room(trial)
        mind = agent.modules(trial.number, trial.rules, agent.DECISIVE)
        self._modules: list[Module] = [*mind, participant.build(), room.build(self._room)]

        workspace, codelets = mind
        _, snapshot = workspace.served[topics.SNAPSHOT_REQUEST]
        begun = snapshot(None)
        if codelets.graph is not None and isinstance(begun, Snapshot):
            codelets.graph.load(begun)

        worker = Presence(
            stamp_ns=0,
            module=codelets.name,
            instance=codelets.instance,
            alive=True,
            observer=workspace.instance,
        )
        self._waiting: deque[Message] = deque([worker, *self._room.begin()])

    def go_out(self) -> None:
        """Walk until the participant waits at the last post for the room to change."""
        while self._waiting and not _is_wait(self._waiting[0]):
            self._hand_over()

    def back(self, condition: Condition) -> Response:
        """Return in a condition. The walk stays where it is, for others.

        Raises CogmapError if no response comes.
        """
        tables: dict[int, object] = {id(topic): topic for topic in topics.ALL}
        way = copy.deepcopy(self, tables)
        way._room.return_in(condition)
        while way._waiting and way._room.response is None:
            way._hand_over()

        response = way._room.response
        if response is None:
            raise CogmapError(f"no response in {self._trial}, {condition.value}")
        return response

    def _hand_over(self) -> None:
        """Hand the oldest message to all that receive it."""
        message = self._waiting.popleft()
        topic = topics.of(message)
        for module in self._modules:
            if topic in module.handlers:
                self._waiting.extend(module.feed(message))


def responses(trial: Trial, conditions: Sequence[Condition]) -> list[Response]:
    """Return the response of `trial` in each of `conditions`.

    Garbage is collected between trials, not amid them: that takes a fifth of the time.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        walk = Walk(trial)
        walk.go_out()
        return [walk.back(condition) for condition in conditions]
    finally:
        if was_enabled:
            gc.enable()


def _is_wait(message: Message) -> bool:
    return isinstance(message, Action) and message.scheme == room.WAIT
