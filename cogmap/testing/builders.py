"""Builders of messages, nodes and graphs, with usual values for what a test is not about."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.cognition import Broadcast, Coalition, Trigger
from cogmap.schemas.graph import Cells, Delta, Operation, Phase
from cogmap.schemas.nodes import (
    ROOT_MAP,
    SELF_ID,
    AnyNode,
    Map,
    Object,
    PlaceColumn,
    Self,
    object_id,
)
from cogmap.schemas.sensing import Odometry, Percept, Percepts, RangeScan, SelfMotion

Rows = Sequence[Sequence[float]]
Cell = tuple[int, int]

PERIOD_NS = 200_000_000
"""The time between two views: five a second, as the simulated cameras have it."""

STRAIGHT: Rows = ((2.0, 0.0, 0.2, 0.1, 0.01),)
"""A view's self-motion at 2 m/s straight on, as SelfMotion has its rows."""


def stamp_ns(frame: int) -> int:
    """Return the time of view `frame`; the first one is number 0."""
    return (frame + 1) * PERIOD_NS


def self_motion(frame: int = 0, rows: Rows = STRAIGHT) -> SelfMotion:
    """Make the self-motion between the view before and view `frame`.

    Each row has speed (m/s), turn rate (rad/s), duration (s), and the standard deviations of the
    first two.
    """
    motions = np.array(rows, np.float64).reshape(-1, 5)
    return SelfMotion(
        stamp_ns=stamp_ns(frame),
        frame=frame,
        since_ns=stamp_ns(frame - 1),
        motions=Array.of(motions),
    )


def odometry(
    seq: int = 0,
    speed_m_s: float = 1.0,
    turn_rate_rad_s: float = 0.0,
    *,
    stamp_ns: int = 0,
    dt_s: float = 0.05,
    source: str = "sim",
) -> Odometry:
    """Make a reading of the wheels, which roll straight ahead unless a turn rate is given."""
    return Odometry(
        seq=seq,
        stamp_ns=stamp_ns,
        source=source,
        speed_m_s=speed_m_s,
        turn_rate_rad_s=turn_rate_rad_s,
        dt_s=dt_s,
    )


def range_scan(*rays: tuple[float, float], frame: int = 1, **facts: Any) -> RangeScan:
    """Make a scan of these rays: bearing (rad, to the left) and range (m, 0 if nothing is met)."""
    bearing_rad, range_m = np.array(rays, np.float32).reshape(-1, 2).T
    usual = {"stamp_ns": stamp_ns(frame), "frame": frame}
    return RangeScan(
        bearing_rad=Array.of(bearing_rad), range_m=Array.of(range_m), **(usual | facts)
    )


def percept(
    label: str = "house", bearing_rad: float = 0.0, range_m: float = 10.0, **facts: Any
) -> Percept:
    """Make a percept of one building: whole, well recognized, and known of which individual object
    it is, whose label is its name. `unidentified` leaves that for the workspace to find.
    """
    usual: dict[str, Any] = {
        "name": label,
        "activation": 0.9,
        "evidence": facts.get("activation", 0.9),
        "bearing_sd_rad": 0.02,
        "range_sd_m": 0.3,
        "width_m": 8.0,
        "height_m": 6.0,
        "whole": True,
        "box_px": (0, 0, 10, 10),
    }
    return Percept(label=label, bearing_rad=bearing_rad, range_m=range_m, **(usual | facts))


def unidentified(seen: Percept, **facts: Any) -> Percept:
    """Return a percept as perception publishes it: not known of which individual object it is."""
    return msgspec.structs.replace(seen, label="", **facts)


def percept_at(pose: npt.ArrayLike, label: str, position_m: npt.ArrayLike, **facts: Any) -> Percept:
    """Make the percept of what stands at `position_m` (x, y), seen without error from `pose` (x, y,
    heading).
    """
    x_m, y_m, heading_rad = np.asarray(pose, float).tolist()
    to_x_m, to_y_m = (np.asarray(position_m, float) - (x_m, y_m)).tolist()
    bearing_rad = math.remainder(math.atan2(to_y_m, to_x_m) - heading_rad, math.tau)
    return percept(label, bearing_rad, math.hypot(to_x_m, to_y_m), **facts)


def percepts(frame: int = 0, *objects: Percept, road_m: Rows = (), **facts: Any) -> Percepts:
    """Make what was recognized in view `frame`, with points (x, y) of road in the robot's frame."""
    points_m = np.array(road_m, np.float32).reshape(-1, 2)
    usual = {"stamp_ns": stamp_ns(frame), "frame": frame}
    return Percepts(objects=list(objects), road_m=Array.of(points_m), **(usual | facts))


def agent(samples: npt.ArrayLike | None = None, **facts: Any) -> Self:
    """Make the self node, fully active, at the origin unless `facts` have another pose.

    `samples` (n, 3) are of its pose; by default all 200 are the origin.
    """
    values = np.zeros((200, 3)) if samples is None else samples
    matrix = Matrix.of(values)
    return Self(id=SELF_ID, activation=1.0, base_level=1.0, samples=matrix, **facts)


def landmark(
    label: str = "house", samples_m: npt.ArrayLike = ((10.0, 0.0),), **facts: Any
) -> Object:
    """Make an object, fully active, with `samples_m` (n, 2) of its position; its name is its label,
    unless `facts` have other names.
    """
    values = np.asarray(samples_m, np.float64)
    mean_m = values.mean(axis=0)
    offsets_m = Matrix.of(values - mean_m, "<f2")
    usual: dict[str, Any] = {
        "activation": 1.0,
        "names": {label: 1.0},
        "x_m": float(mean_m[0]),
        "y_m": float(mean_m[1]),
    }
    return Object(id=object_id(label), label=label, offsets_m=offsets_m, **(usual | facts))


def cells(column: PlaceColumn, values: Mapping[Cell, float], map_id: str = ROOT_MAP) -> Cells:
    """Make the operation that writes a column of place nodes, by cell (i, j)."""
    where = np.array(list(values), np.int32).reshape(-1, 2)
    written = np.array(list(values.values()), np.float32)
    return Cells(map=map_id, column=column, cells=Array.of(where), values=Array.of(written))


def graph_of(*operations: Operation, cell_m: float = 1.0) -> Graph:
    """Make a graph at version 1, in cycle 1, of a root map and what `operations` add."""
    graph = Graph()
    root = Map(id=ROOT_MAP, cell_m=cell_m)
    delta = Delta(version=1, cycle=1, phase=Phase.PERCEPTS, operations=[root, *operations])
    graph.apply(delta)
    return graph


def context(seen: Percepts | None = None, rows: Rows = STRAIGHT, cycle: int = 1) -> CycleContext:
    """Make what `due` of a codelet receives: a cycle's percepts and self-motion, on version 1."""
    return CycleContext(cycle, seen or percepts(), self_motion(0, rows).motions, version=1)


def task(codelet: str, identifier: str = "", **facts: Any) -> Task:
    """Make a task of cycle 1 on version 1, without self-motion or road unless `facts` have them."""
    usual: dict[str, Any] = {
        "cycle": 1,
        "version": 1,
        "motions": Array.of(np.zeros((0, 5))),
        "road_m": Array.of(np.zeros((0, 2), np.float32)),
    }
    task_id = identifier or f"1/{codelet}"
    return Task(task_id=task_id, codelet=codelet, **(usual | facts))


def run_codelet(
    codelet: Codelet, asked: Task, graph: Graph, config: msgspec.Struct | None = None
) -> Answer:
    """Run one task of a codelet, with its default settings unless `config` has others."""
    return codelet.run(asked, graph, codelet.config() if config is None else config)


def broadcast(*nodes: AnyNode, cycle: int = 1, at_ns: int = 0, **facts: Any) -> Broadcast:
    """Make the broadcast of a coalition of these nodes, with `facts` of the coalition."""
    usual: dict[str, Any] = {"codelet": "test", "activation": 0.5}
    coalition = Coalition(nodes=list(nodes), **(usual | facts))
    return Broadcast(
        stamp_ns=at_ns, cycle=cycle, trigger=Trigger.ONE_COALITION, coalition=coalition
    )
