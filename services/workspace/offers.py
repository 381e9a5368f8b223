"""Offers: operations that no task asked for, committed when the next cycle begins."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from cogmap.errors import MessageError
from cogmap.graph.individuals import is_among
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Link, Operation
from cogmap.schemas.nodes import GraphNode, LinkKind, Object, nearest_place, percept_id
from cogmap.services.workspace.commit import Ledger
from cogmap.services.workspace.rules import may_offer


class Offers:
    """The offers that wait for the next cycle.

    Each cycle waits for an offer of each of the instances `awaited`, made after the cycle before.
    """

    def __init__(self, awaited: Iterable[str]) -> None:
        self._awaited = frozenset(awaited)
        self._newest_cycle: dict[str, int] = {}
        self._waiting: list[Offer] = []
        self._restored_cycle = 0

    def restore(self, cycle: int) -> None:
        """Ignore offers made before `cycle`: what ended before a restore was committed."""
        self._restored_cycle = cycle

    def put(self, offer: Offer) -> None:
        """Add an offer."""
        if offer.cycle >= self._restored_cycle:
            self._waiting.append(offer)

        newest = self._newest_cycle.get(offer.source, 0)
        self._newest_cycle[offer.source] = max(newest, offer.cycle)

    def complete(self, ended_cycle: int) -> bool:
        """Decide whether every awaited instance has made its offer after `ended_cycle`."""
        for name in self._awaited:
            newest = self._newest_cycle.get(name, 0)
            if newest < ended_cycle:
                return False

        return True

    def take(self, ledger: Ledger, entering: list[Operation], cycle: int) -> list[Operation]:
        """Take the operations of all valid offers, in order of source and number, as of `cycle`, in
        which `entering` is written before them.

        The ledger rejects the others, and objects that are on the map already.
        """
        waiting = sorted(self._waiting, key=lambda offer: (offer.source, offer.seq))
        self._waiting = []

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

        return _with_objects(operations, ledger, entering)


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
