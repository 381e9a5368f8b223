"""A codelet, declared once: workspace and workers work from that declaration alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Task
from cogmap.schemas.cognition import Coalition, Event
from cogmap.schemas.graph import Operation, Phase
from cogmap.schemas.nodes import NEVER_NS, GraphNode, LinkKind, PlaceColumn
from cogmap.schemas.sensing import Percept, Percepts, PlaceMatch, RangeScan

ENTRY_POINTS = "cogmap.codelets"
"""The group of entry points by which codelets of other packages are found."""

Written = type[GraphNode] | LinkKind | PlaceColumn


@dataclass(frozen=True)
class CycleContext:
    """What a cognitive cycle is about: a view's percepts, the self-motion since the self node was
    last moved at `since_ns`, as in SelfMotion, and the range scan of the view, where there is one.
    Percepts that are `waiting` are of known objects, but it cannot be told yet of which: each has
    the label of the likeliest, and states its place as badly as the others stand from that.
    """

    cycle: int
    percepts: Percepts
    motions: Array
    version: int = 0
    scan: RangeScan | None = None
    since_ns: int = NEVER_NS
    waiting: tuple[Percept, ...] = ()

    @property
    def stamp_ns(self) -> int:
        """Return the time of the view."""
        return self.percepts.stamp_ns

    def task(
        self,
        codelet: str,
        about: Iterable[str] = (),
        *,
        subject: str = "",
        percepts: Iterable[Percept] = (),
        matches: Iterable[PlaceMatch] = (),
        with_motions: bool = False,
        with_road: bool = False,
        with_boundary: bool = False,
        with_scan: bool = False,
    ) -> Task:
        """Return a task for `codelet` about nodes `about`, by id.

        `subject` distinguishes the tasks of one codelet in one cycle. The task carries what was
        sensed if it is asked for: `with_boundary` asks for where the road ends.
        """
        task_id = f"{self.cycle}/{codelet}"
        if subject:
            task_id = f"{task_id}/{subject}"

        rays = None
        if with_scan and self.scan is not None:
            columns = [self.scan.bearing_rad.numpy(), self.scan.range_m.numpy()]
            rays = Array.of(np.column_stack(columns), "<f4")

        return Task(
            stamp_ns=self.stamp_ns,
            task_id=task_id,
            codelet=codelet,
            cycle=self.cycle,
            version=self.version,
            about=list(about),
            percepts=list(percepts),
            matches=list(matches),
            motions=self.motions if with_motions else None,
            since_ns=self.since_ns if with_motions else NEVER_NS,
            road_m=self.percepts.road_m if with_road else None,
            road_boundary_m=self.percepts.road_boundary_m if with_boundary else None,
            scan=rays,
        )


@dataclass(frozen=True)
class Answer:
    """What a codelet proposes: operations on the graph, coalitions for the global workspace, and
    events that are published once the operations are committed.
    """

    operations: list[Operation] = field(default_factory=list)
    coalitions: list[Coalition] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


class NoSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The settings of a codelet that has none."""


@dataclass(frozen=True)
class Codelet:
    """One structure-building or attention codelet.

    It runs in `phase` of each cycle, or beside the cycle (Phase.BACKGROUND, one task at a time).
    `due(context, graph, config)` returns its tasks for this cycle, `run(task, graph, config)` its
    answer to one. Both only read the graph. `reads` and `writes` are the kinds of nodes and links
    and the place columns that it reads and may write. `config` is the type of its settings, from
    the section `section` of the configuration; one without settings has neither.
    """

    name: str
    phase: Phase
    due: Callable[[CycleContext, Graph, Any], list[Task]]
    run: Callable[[Task, Graph, Any], Answer]
    reads: frozenset[Written]
    writes: frozenset[Written]
    config: type[msgspec.Struct] = NoSettings
    section: str = ""

    def may_write(self, written: object) -> bool:
        """Return true if it may write nodes or links of that kind, or that place column.

        Links of kinds that are not in the table of link kinds may be written by every codelet.
        """
        return written in self.writes


@dataclass(frozen=True)
class ConfiguredCodelet:
    """A codelet with its settings."""

    codelet: Codelet
    config: Any

    @property
    def name(self) -> str:
        """Return the codelet's name."""
        return self.codelet.name

    def due(self, context: CycleContext, graph: Graph) -> list[Task]:
        """Return its tasks for this cycle."""
        return self.codelet.due(context, graph, self.config)

    def run(self, task: Task, graph: Graph) -> Answer:
        """Return its answer to a task."""
        return self.codelet.run(task, graph, self.config)
