"""Links of the graph, indexed by source and by target."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator
from itertools import islice

from cogmap.schemas.graph import Links
from cogmap.schemas.nodes import EXCLUSIVE_LINKS

Weights = dict[str, float]
Targets = dict[str, Weights]
SingleTargets = dict[str, tuple[str, float]]
Sources = dict[str, tuple[str, ...]]


class LinkIndex:
    """Weighted links by kind: from each source to its targets, and back.

    Of an exclusive kind a source has one link, kept as a pair, which links to the same target
    share; sources are kept as tuples. That is a third of the memory that dicts would take on a map
    of a hundred thousand objects. `name_of` returns the string by which a node is known already, so
    that the names of links take no memory of their own.
    """

    def __init__(self, name_of: Callable[[str], str] = str) -> None:
        self._name_of = name_of
        self._targets: defaultdict[str, Targets] = defaultdict(dict)
        self._target: defaultdict[str, SingleTargets] = defaultdict(dict)
        self._sources: defaultdict[str, Sources] = defaultdict(dict)

    def put(self, kind: str, source: str, target: str, weight: float) -> None:
        """Set the weight of a link; one of an exclusive kind replaces the source's link."""
        if kind in EXCLUSIVE_LINKS:
            self._put_exclusive(kind, source, target, weight)
            return

        weights = self._targets[kind].setdefault(source, {})
        if target not in weights:
            self._add_source(kind, target, source)
        weights[target] = weight

    def put_all(self, links: Links) -> None:
        """Set the weights of many links of one kind."""
        if links.kind in EXCLUSIVE_LINKS:
            self._put_all_exclusive(links)
            return

        targets = self._targets[links.kind]
        for source, weights in links.weights.items():
            if not weights:
                continue

            known = targets.get(source)
            if known is None:
                known = targets[source] = {}

            before = len(known)
            known.update(weights)
            if len(known) > before:
                # A dict keeps the order in which it was made: these were added last.
                newest = list(islice(reversed(known), len(known) - before))
                for target in reversed(newest):
                    self._add_source(links.kind, target, source)

    def drop(self, kind: str, source: str, target: str) -> None:
        """Remove a link, if it exists."""
        if kind in EXCLUSIVE_LINKS:
            link = self._target[kind].get(source)
            if link is not None and link[0] == target:
                del self._target[kind][source]
                self._remove_sources(kind, target, {source})
            return

        if target in self._targets[kind].get(source, {}):
            self._drop_target(kind, source, target)
            self._remove_sources(kind, target, {source})

    def drop_node(self, node: str) -> None:
        """Remove all links from and to a node."""
        for kind in self.kinds():
            for target in list(self.targets(node, kind)):
                self.drop(kind, node, target)

            for source in self._sources[kind].pop(node, ()):
                self._drop_target(kind, source, node)

    def targets(self, source: str, kind: str) -> Weights:
        """Return the targets of a source's links of a kind, and their weights."""
        if kind not in EXCLUSIVE_LINKS:
            weights = self._targets[kind].get(source, {})
            return dict(weights)

        link = self._target[kind].get(source)
        if link is None:
            return {}
        target, weight = link
        return {target: weight}

    def target(self, source: str, kind: str) -> str | None:
        """Return the target of a source's link of an exclusive kind; None if it has none."""
        link = self._target[kind].get(source)
        if link is None:
            return None
        target, _ = link
        return target

    def sources(self, target: str, kind: str) -> tuple[str, ...]:
        """Return the sources of the links of a kind to a target, in the order in which they were
        made.
        """
        sources = self._sources[kind]
        return sources.get(target, ())

    def kinds(self) -> list[str]:
        """Return the kinds of links that exist or existed, by name."""
        return sorted({*self._targets, *self._target})

    def in_bulk(self) -> Iterator[Links]:
        """Yield all links by kind, in an order that depends on the content alone."""
        for kind in self.kinds():
            if kind in EXCLUSIVE_LINKS:
                pairs = sorted(self._target[kind].items())
                weights = {source: {target: weight} for source, (target, weight) in pairs}
            else:
                several = sorted(self._targets[kind].items())
                weights = {source: dict(sorted(targets.items())) for source, targets in several}

            if weights:
                yield Links(kind=kind, weights=weights)

    def clear(self) -> None:
        """Remove all links."""
        self._targets.clear()
        self._target.clear()
        self._sources.clear()

    def _put_exclusive(self, kind: str, source: str, target: str, weight: float) -> None:
        source = self._name_of(source)
        before = self._target[kind].get(source)

        pair = self._pair(kind, target, weight)
        if before is None:
            self._add_source(kind, pair[0], source)
        elif before[0] != target:
            self._remove_sources(kind, before[0], {source})
            self._add_source(kind, pair[0], source)

        self._target[kind][source] = pair

    def _put_all_exclusive(self, links: Links) -> None:
        """Set many links, and the sources of each target once. One by one, a map with a hundred
        thousand objects would have them copied as often.
        """
        kind = links.kind
        target_of = self._target[kind]
        pairs: dict[tuple[str, float], tuple[str, float]] = {}
        added: defaultdict[str, list[str]] = defaultdict(list)
        removed: defaultdict[str, set[str]] = defaultdict(set)

        for name, weights in links.weights.items():
            if not weights:
                continue

            link = next(reversed(weights.items()))
            pair = pairs.get(link)
            if pair is None:
                pair = pairs[link] = self._pair(kind, *link)

            source = self._name_of(name)
            before = target_of.get(source)
            target_of[source] = pair
            if before is None:
                added[pair[0]].append(source)
            elif before[0] != pair[0]:
                removed[before[0]].add(source)
                added[pair[0]].append(source)

        for target, sources in removed.items():
            self._remove_sources(kind, target, sources)
        for target, new in added.items():
            known = self._sources[kind].get(target, ())
            self._sources[kind][target] = (*known, *new)

    def _pair(self, kind: str, target: str, weight: float) -> tuple[str, float]:
        """Return a target and a weight: the pair of another link if that is the same."""
        sources = self._sources[kind].get(target, ())
        if sources:
            pair = self._target[kind][sources[0]]
            if pair == (target, weight):
                return pair

        return self._name_of(target), weight

    def _drop_target(self, kind: str, source: str, target: str) -> None:
        """Remove a link from its source alone."""
        if kind in EXCLUSIVE_LINKS:
            del self._target[kind][source]
            return

        weights = self._targets[kind][source]
        del weights[target]
        if not weights:
            del self._targets[kind][source]

    def _add_source(self, kind: str, target: str, source: str) -> None:
        sources = self._sources[kind]
        before = sources.get(target, ())
        sources[target] = (*before, source)

    def _remove_sources(self, kind: str, target: str, removed: Collection[str]) -> None:
        sources = self._sources[kind]
        rest = tuple(source for source in sources[target] if source not in removed)

        if rest:
            sources[target] = rest
        else:
            del sources[target]
