"""Learns from broadcasts, and primes the next view by what was learned. Pure."""

from __future__ import annotations

from collections import deque

import msgspec

from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.nodes import Object, category_id, feeling_id, map_number, name_id
from cogmap.schemas.sensing import Associations, Percept
from cogmap.services.epam.association.graph import AssociativeGraph
from cogmap.services.epam.association.prior import Prior
from cogmap.services.epam.association.relations import related
from cogmap.services.epam.config import Priming

BEHIND = 2
"""A view is primed by what was conscious up to so many views before it."""
MAX_WAITING = 64
"""So many broadcasts wait for a view, of 13 s at five a second: where a simulation publishes the
percepts itself, there is none.
"""
BROADCASTS_PER_PUBLICATION = 16
"""The graph is published, and so kept, after so many broadcasts: a crash forgets at most those."""


class Primer:
    """The associative graph, and the broadcasts that it has not learned from yet.

    A view is primed by broadcasts up to the view BEHIND it. Those are there when it comes, as the
    robot has obeyed a command since that waited for them: in lockstep `is_ready` makes sure. The
    graph is published after every `broadcasts_per_publication`.
    """

    def __init__(
        self, config: Priming, broadcasts_per_publication: int = BROADCASTS_PER_PUBLICATION
    ) -> None:
        self._broadcasts_per_publication = broadcasts_per_publication
        self._config = config
        self._graph = AssociativeGraph(config)
        self._related: dict[str, dict[str, float]] = {}
        self._waiting: list[Broadcast] = []
        self._views_ns: deque[int] = deque(maxlen=BEHIND)
        self._competition_ns = -1
        self._broadcasts = 0

    def on_competition(self, stamp_ns: int) -> None:
        """Note that the competition for the view of this stamp has ended."""
        self._competition_ns = stamp_ns

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Keep a broadcast until a view comes that it may prime; none that waits is later."""
        now_ns = broadcast.stamp_ns
        self._waiting = [each for each in self._waiting if each.stamp_ns <= now_ns]
        if now_ns > self._graph.updated_ns:
            self._waiting.append(broadcast)
            del self._waiting[:-MAX_WAITING]

    @property
    def is_ready(self) -> bool:
        """Return whether all is known that the next view is primed by."""
        return len(self._views_ns) < BEHIND or self._competition_ns >= self._views_ns[0]

    def begin(self, view_ns: int) -> Associations | None:
        """Learn from the broadcasts that prime a view; return the graph from time to time."""
        until_ns = self._views_ns[0] if len(self._views_ns) == BEHIND else -1
        self._views_ns.append(view_ns)
        self._graph.be_at(view_ns)

        due = [broadcast for broadcast in self._waiting if broadcast.stamp_ns <= until_ns]
        self._waiting = [each for each in self._waiting if each.stamp_ns > until_ns]
        is_due = False
        for broadcast in sorted(due, key=lambda each: each.stamp_ns):
            stood = related(broadcast.coalition.relations.values())
            self._graph.learn(nodes_of(broadcast), broadcast.stamp_ns, stood)
            self._broadcasts += 1
            is_due |= self._broadcasts % self._broadcasts_per_publication == 0

        if due:
            self._related = self._graph.related()
        return self._graph.published() if is_due else None

    def prior(self, view_ns: int) -> Prior:
        """Return what is expected of a view."""
        return Prior(self._graph.primed(view_ns), self._config.share, self._related)

    def felt(self, percept: Percept) -> Percept:
        """Return `percept` with the feelings that its PAM node activates; if the object was never
        conscious, those of its category.
        """
        name = name_id(percept.name)
        if name not in self._graph:
            name = category_id(percept.function)

        feelings = self._graph.feelings(name, percept.activation)
        return msgspec.structs.replace(percept, feelings=feelings)

    def published(self) -> Associations:
        """Return the graph as it is now."""
        return self._graph.published()

    def restore(self, kept: Associations) -> None:
        """Continue with a graph that was published. Raises MessageError if it is not whole."""
        self._graph.restore(kept)
        self._related = self._graph.related()


def nodes_of(broadcast: Broadcast) -> list[str]:
    """Return the PAM nodes that are conscious in a broadcast: objects, by their look, unless they
    are in it as missing, the categories of those, the sub-maps that these are in, and what is felt.
    """
    coalition = broadcast.coalition
    is_surprise = coalition.feeling is Feeling.SURPRISE
    names: dict[str, None] = {}
    for node in coalition.nodes:
        is_missing = is_surprise and node.salience < 0
        if not isinstance(node, Object) or is_missing:
            continue
        if node.look:
            names[name_id(node.look)] = None
        if node.function:
            names[category_id(node.function)] = None

    for name in coalition.maps:
        if map_number(name):
            names[name] = None
    if coalition.feeling:
        names[feeling_id(coalition.feeling)] = None
    return list(names)
