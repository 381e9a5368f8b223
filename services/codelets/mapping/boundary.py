"""The boundary codelet: links that cross where the road ends, or what stands there, are cut (paper
§5.5: links near boundaries have weight 0).

Evidence accumulates over sightings, so that one mistaken view cuts nothing and what was blocked is
free again once it is seen to be.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.crossings import crossings
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, LINK_OFFSETS, WEIGHT_COLUMNS, Window
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.array import Array
from schemas.codelets import Task
from schemas.graph import Phase
from schemas.nodes import SELF_ID, PlaceColumn, Self
from services.codelets.config import SECTION, Config
from services.codelets.mapping.evidence import accumulated, blended, weights_of
from services.codelets.mapping.local_grid import LocalGrid
from services.codelets.mapping.rays import Rays, clear_cells, rays_of, walls

JOIN_M = 1.2
# In cells, from the middle of one along both axes: road there is road at the place node, and an
# edge there is right beside it.
ROAD_WITHIN = 0.35
BESIDE_WITHIN = 0.2
ROAD_STEP = 0.25
RAY_CERTAINTY = 0.5
WRITTEN = (*EVIDENCE_COLUMNS, *WEIGHT_COLUMNS, PlaceColumn.OBSTACLE)
COLUMNS = (*WRITTEN, PlaceColumn.ROAD)


class Edges(NamedTuple):
    """Where the ground ends that can be driven on, as straight segments, (k, 2) each, in cells."""

    starts: Floats
    ends: Floats

    def middles(self) -> Floats:
        """(k, 2): the middle of each."""
        return (self.starts + self.ends) / 2


class Seen(NamedTuple):
    """What a view shows of the cells around the agent, (w, h) each: which are road at their
    centre, in which something stands, through which rays pass, and how sure that is, 0 to 1.
    """

    is_road: Booleans
    is_hit: Booleans
    is_clear: Booleans
    certainty: Floats


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task in each cycle whose view shows where the road ends, or what stands around."""
    ends = context.percepts.road_boundary_m.shape[0]
    rays = 0 if context.scan is None else context.scan.range_m.shape[0]
    if not ends and not rays:
        return []

    task = context.task(
        CODELET.name, about=[SELF_ID], with_road=True, with_boundary=True, with_scan=True
    )
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """New evidence and weights of the links around the agent, and the obstacles there; none while
    the agent is lost.
    """
    agent = graph.agent
    if agent is None or task.road_m is None or task.road_boundary_m is None:
        raise MessageError(f"task {task.task_id}: no self node, or no road points")
    if agent.is_lost:
        return Answer()

    grid = LocalGrid.around(agent, graph.cell_m(agent.map), config.boundary_reach_m)
    rays = rays_of(task.scan, task.road_m, grid, config.boundary_reach_m, config.range_sd_share)
    edges = _edges(task.road_boundary_m, rays, grid, config)
    seen = _seen(task.road_m, edges, rays, grid, config)
    known = graph.places.window(agent.map, COLUMNS, grid.extent)

    cut = _cut(edges, grid, config)
    evidence = accumulated(known.evidence(), cut, _free(seen, known))
    has_changed = evidence != known.evidence()
    weights = np.where(has_changed, weights_of(evidence), known.weights())

    obstacle = known.column(PlaceColumn.OBSTACLE)
    is_seen = seen.is_hit | seen.is_clear | seen.is_road
    in_view = np.where(is_seen, seen.certainty, 0.0)
    obstacle = blended(obstacle, seen.is_hit.astype(np.float64), in_view)

    written = len(WRITTEN)
    after = np.concatenate([evidence, weights, obstacle[None]])
    return Answer(grid.changed(WRITTEN, known.values[:written], after))


CODELET = Codelet(
    name="boundary",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, *COLUMNS}),
    writes=frozenset(WRITTEN),
    config=Config,
    section=SECTION,
)


def _seen(road_m: Array, edges: Edges, rays: Rays, grid: LocalGrid, config: Config) -> Seen:
    road = grid.positions(np.asarray(road_m.numpy(), np.float64))
    is_road = grid.counts(_central(road, ROAD_WITHIN)) > 0
    # Whether a place node right beside a boundary is before or behind it no view can decide.
    is_beside = grid.counts(_central(edges.middles(), BESIDE_WITHIN)) > 0

    return Seen(
        is_road=is_road & ~is_beside,
        is_hit=grid.counts(rays.hits()) > 0,
        is_clear=clear_cells(rays, grid) & ~is_beside,
        certainty=grid.certainty(grid.range_m(), config.range_sd_share),
    )


def _central(positions: Floats, within: float) -> Floats:
    """(k, 2): those of (n, 2) positions that are near the middle of their cell, along both axes."""
    from_middle = np.abs(positions - np.rint(positions))
    central: Floats = positions[(from_middle <= within).all(axis=1)]
    return central


def _edges(boundary_m: Array, rays: Rays, grid: LocalGrid, config: Config) -> Edges:
    """Where the road ends, and what the rays hit."""
    points_m = np.asarray(boundary_m.numpy(), np.float64)
    road_starts, road_ends = _road_edges(points_m, config.boundary_reach_m)
    wall_starts, wall_ends = walls(rays, grid.cell_m)

    return Edges(
        starts=np.concatenate([grid.positions(road_starts), wall_starts]),
        ends=np.concatenate([grid.positions(road_ends), wall_ends]),
    )


def _cut(edges: Edges, grid: LocalGrid, config: Config) -> Floats:
    """(4, w, h): the links that edges cross, by how sure their place is, 0 to 1."""
    away = edges.middles() - grid.pose[:2] / grid.cell_m
    range_m = np.hypot(away[:, 0], away[:, 1]) * grid.cell_m
    certainty = grid.certainty(range_m, config.range_sd_share)

    crossed = crossings(edges.starts, edges.ends)
    i = crossed.i - grid.extent.lower[0]
    j = crossed.j - grid.extent.lower[1]
    width, height = grid.extent.shape
    is_inside = (i >= 0) & (i < width) & (j >= 0) & (j < height)

    cut = np.zeros((len(LINK_OFFSETS), width, height))
    links = (crossed.direction[is_inside], i[is_inside], j[is_inside])
    np.maximum.at(cut, links, certainty[crossed.segment[is_inside]])
    return cut


def _road_edges(points_m: Floats, reach_m: float) -> tuple[Floats, Floats]:
    """Where the road ends, as straight segments from (k, 2) to (k, 2): each two of the points
    within reach that are at most JOIN_M apart. A point alone is taken for a mistake.
    """
    range_m = np.hypot(points_m[:, 0], points_m[:, 1])
    near_m = points_m[range_m <= reach_m]

    apart_m = near_m[:, None] - near_m
    squared_m2 = (apart_m**2).sum(axis=2)
    one, other = np.nonzero(np.triu(squared_m2 <= JOIN_M**2, k=1))
    return near_m[one], near_m[other]


def _free(seen: Seen, known: Window) -> Floats:
    """(4, w, h): the links that are seen to be free, by how sure that is, 0 to 1.

    Those between place nodes that are both seen as road are. A ray passes over a kerb: that it
    passes through both place nodes is believed where the ground at both is of one kind, and less.
    """
    road = np.maximum(known.column(PlaceColumn.ROAD), seen.is_road)
    here = np.stack([seen.is_road, seen.is_clear, road])
    there = _beyond(here)

    road_between = (here[0] > 0) & (there[:, 0] > 0)
    clear_between = (here[1] > 0) & (there[:, 1] > 0)
    same_ground = np.abs(road - there[:, 2]) < ROAD_STEP

    sure = np.where(road_between, 1.0, np.where(clear_between & same_ground, RAY_CERTAINTY, 0.0))
    return sure * seen.certainty


def _beyond(values: Singles) -> Singles:
    """(4, k, w, h): of each link of (k, w, h) cells, the values at its other end; 0 outside."""
    number, width, height = values.shape
    padded = np.zeros((number, width + 2, height + 2), values.dtype)
    padded[:, 1:-1, 1:-1] = values

    shifted = []
    for di, dj in LINK_OFFSETS.tolist():
        rows = slice(1 + di, 1 + di + width)
        columns = slice(1 + dj, 1 + dj + height)
        shifted.append(padded[:, rows, columns])

    return np.stack(shifted)
