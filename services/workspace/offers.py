"""Offers: operations that no task asked for, committed when the next cycle begins."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import msgspec

from cogmap.errors import MessageError
from cogmap.graph.individuals import is_among
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode, Link, Operation
from cogmap.schemas.nodes import Goal, GraphNode, LinkKind, Object, nearest_place, percept_id
from cogmap.services.workspace.commit import Ledger
from cogmap.services.workspace.rules import may_offer

OFFERING = ("memory", "motor")
"""The modules that make an offer in each cycle of lockstep, perhaps of nothing."""

MAX_OPERATIONS = 256
MAX_OF_OTHERS = 512
OTHERS = "all others"
"""Operations that a source may offer for one cycle, and all that are not modules together: a tour
has a few goals, and memory returns a few objects at a time. More would hold up the cycle.
"""

MAX_GOALS = 64
"""Goals that the agent has at once, at most, beside those that it was given at its start: planning
takes longer for each.
"""


class Offers:
    """The offers that wait for the next cycle.

    Each cycle waits for an offer of each of the instances `awaited`, made after the cycle before.
    `given` is how many goals the agent has from its start.
    """

    def __init__(self, awaited: Iterable[str], given: int = 0) -> None:
        self._max_goals = MAX_GOALS + given
        self._awaited = frozenset(awaited)
        self._newest_cycle: dict[str, int] = {}
        self._waiting: list[Offer] = []
        self._sizes: Counter[str] = Counter()
        self._left_out: list[str] = []
        self._present: set[str] = set()
        self._restored_cycle = 0

    def restore(self, cycle: int) -> None:
        """Ignore offers made before `cycle`: what ended before a restore was committed."""
        self._restored_cycle = cycle

    def put(self, offer: Offer) -> None:
        """Add an offer. Raises MessageError if its source, or all that are not modules together,
        would have offered more for the next cycle than is taken in one; what a module offers too
        much is left out, and counted with the next delta.
        """
        is_module = offer.source in OFFERING
        is_old = offer.cycle < self._restored_cycle
        size = 0 if is_old else max(1, len(offer.operations))
        reason = self._over_quota(offer.source, size, MAX_OPERATIONS)
        if not is_module:
            reason = reason or self._over_quota(OTHERS, size, MAX_OF_OTHERS)
        if reason and not is_module:
            raise MessageError(reason)

        if is_module:
            newest = self._newest_cycle.get(offer.source, 0)
            self._newest_cycle[offer.source] = max(newest, offer.cycle)
        if reason:
            self._left_out.append(reason)
        elif not is_old:
            self._sizes[offer.source] += size
            self._sizes[OTHERS] += 0 if is_module else size
            self._waiting.append(offer)

    def presence(self, instance: str, is_alive: bool) -> None:
        """Note that an instance of a module came or went."""
        if is_alive:
            self._present.add(instance)
        else:
            self._present.discard(instance)

    def complete(self, ended_cycle: int, is_repeated: bool = False) -> bool:
        """Decide whether every awaited instance has made its offer after `ended_cycle`.

        Where the view of the next cycle is repeated, the offer of one that is present was lost.
        """
        for name in self._awaited:
            newest = self._newest_cycle.get(name, 0)
            is_lost = is_repeated and name in self._present
            if newest < ended_cycle and not is_lost:
                return False

        return True

    def take(self, ledger: Ledger, entering: list[Operation], cycle: int) -> list[Operation]:
        """Take the operations of all valid offers, in order of source and number, as of `cycle`, in
        which `entering` is written before them.

        The ledger rejects the others, and objects that are on the map already.
        """
        waiting = sorted(self._waiting, key=lambda offer: (offer.source, offer.seq))
        self._waiting = []
        self._sizes.clear()
        for reason in self._left_out:
            ledger.reject(reason)
        self._left_out = []

        operations: list[Operation] = []
        for offer in waiting:
            try:
                ledger.check_offer(offer, may_offer)
            except MessageError as error:
                ledger.reject(str(error))
            else:
                for operation in offer.operations:
                    # A node without a cycle is as active now as it states.
                    if isinstance(operation, GraphNode) and operation.cycle == 0:
                        operations.append(msgspec.structs.replace(operation, cycle=cycle))
                    else:
                        operations.append(operation)

        operations = _within_goals(operations, ledger, self._max_goals)
        return _with_objects(operations, ledger, entering)

    def _over_quota(self, source: str, size: int, most: int) -> str:
        """Return why so much more of a source is too much; empty if it is not."""
        waiting = self._sizes[source] + size
        if waiting <= most:
            return ""
        return (
            f"offer of {source}: {waiting} operations would wait for the next cycle, "
            f"at most {most} are taken in one: offer the rest later"
        )


def _within_goals(operations: list[Operation], ledger: Ledger, most: int) -> list[Operation]:
    """Reject each new goal beyond so many."""
    graph = ledger.graph
    goals = {goal.id for goal in graph.of_kind(Goal)}
    accepted: list[Operation] = []
    for operation in operations:
        if isinstance(operation, DropNode):
            goals.discard(operation.id)
        elif isinstance(operation, Goal):
            if operation.id not in goals and len(goals) >= most:
                ledger.reject(f"an offer of {operation.id}: the agent has {most} goals, no more")
                continue
            goals.add(operation.id)
        accepted.append(operation)

    return accepted


def _with_objects(
    operations: list[Operation], ledger: Ledger, entering: list[Operation]
) -> list[Operation]:
    """Link each object of `operations` to its place node; reject those that are on the map already:
    their label is taken, perhaps by what is seen right now, or one of their look is at that place.
    One on the map that is offered with another name is called that from now on.
    """
    graph = ledger.graph
    entered = {each.id for each in entering if isinstance(each, GraphNode)}
    present: list[Object] | None = None
    accepted: list[Operation] = []
    for operation in operations:
        if not isinstance(operation, Object):
            accepted.append(operation)
            continue

        known = graph.get(Object, operation.id)
        if known is not None and operation.given_name not in {"", known.given_name}:
            accepted.append(msgspec.structs.replace(known, given_name=operation.given_name))
            continue

        if present is None:
            present = list(graph.of_kind(Object))
        labels = (operation.id, percept_id(operation.label))
        is_taken = any(label in entered or label in graph.nodes for label in labels)
        if is_taken or is_among(operation, present):
            ledger.reject(f"an offer of {operation.id}: it is on the map already")
            continue

        entered.add(operation.id)
        present.append(operation)
        place = nearest_place(
            operation.x_m, operation.y_m, graph.cell_m(operation.map), operation.map
        )
        accepted += [operation, Link(source=operation.id, target=place, kind=LinkKind.AT)]

    return accepted
