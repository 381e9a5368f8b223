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
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, LINK_OFFSETS, WEIGHT_COLUMNS, Window
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, PlaceColumn, Self
from cogmap.services.codelets.mapping.edges import Edges, cut_links, edges_of
from cogmap.services.codelets.mapping.evidence import accumulated, blended, weights_of
from cogmap.services.codelets.mapping.local_grid import LocalGrid
from cogmap.services.codelets.mapping.rays import Rays, clear_cells, rays_of

# The distance up to which links are cut or freed by what is seen.
REACH_M = 25.0
# In cells, from the middle of one along both axes: road there is road at the place node, and an
# edge there is right beside it.
ROAD_WITHIN = 0.35
BESIDE_WITHIN = 0.2
ROAD_STEP = 0.25
RAY_CERTAINTY = 0.5
WRITTEN = (*EVIDENCE_COLUMNS, *WEIGHT_COLUMNS, PlaceColumn.OBSTACLE)
COLUMNS = (*WRITTEN, PlaceColumn.ROAD)


class Seen(NamedTuple):
    """What a view shows of the cells around the agent, (w, h) each: which are road at their
    centre, in which something stands, through which rays pass, and how sure that is, 0 to 1.
    """

    is_road: Booleans
    is_hit: Booleans
    is_clear: Booleans
    certainty: Floats


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """One task in each cycle whose view shows where the road ends, or what stands around."""
    ends = context.percepts.road_boundary_m.shape[0]
    rays = 0 if context.scan is None else context.scan.range_m.shape[0]
    if not ends and not rays:
        return []

    task = context.task(
        CODELET.name, about=[SELF_ID], with_road=True, with_boundary=True, with_scan=True
    )
    return [task]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """New evidence and weights of the links around the agent, and the obstacles there; none while
    the agent is lost.
    """
    agent = graph.agent
    if agent is None or task.road_m is None or task.road_boundary_m is None:
        raise MessageError(f"task {task.task_id}: no self node, or no road points")
    if agent.misfits.is_lost:
        return Answer()

    grid = LocalGrid.around(agent, graph.cell_m(agent.map), REACH_M)
    known = graph.places.window(agent.map, COLUMNS, grid.extent)
    after = _after(task.road_m, task.road_boundary_m, task.scan, grid, known)
    return Answer(grid.changed(WRITTEN, known.values[: len(WRITTEN)], after))


CODELET = Codelet(
    name="boundary",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, *COLUMNS}),
    writes=frozenset(WRITTEN),
)


def _after(
    road: Array, boundary: Array, scan: Array | None, grid: LocalGrid, known: Window
) -> Singles:
    """(k, w, h): the columns WRITTEN after this view."""
    road_m = np.asarray(road.numpy(), np.float64)
    boundary_m = np.asarray(boundary.numpy(), np.float64)
    rays = rays_of(scan, road_m, grid)
    edges = edges_of(boundary_m, rays, grid)
    seen = _seen(road_m, edges, rays, grid)

    evidence = accumulated(known.evidence(), cut_links(edges, grid), _free(seen, known))
    has_changed = evidence != known.evidence()
    weights = np.where(has_changed, weights_of(evidence), known.weights())

    obstacle = _obstacle(seen, known)
    return np.concatenate([evidence, weights, obstacle[None]])


def _seen(road_m: Floats, edges: Edges, rays: Rays, grid: LocalGrid) -> Seen:
    """What a view shows, of which (n, 2) points are road."""
    road = _central(grid.positions(road_m), ROAD_WITHIN)
    # Whether a place node right beside an edge is before or behind it no view can decide.
    is_beside = grid.has(_central(edges.middles(), BESIDE_WITHIN))

    return Seen(
        is_road=grid.has(road) & ~is_beside,
        is_hit=grid.has(rays.hits()),
        is_clear=clear_cells(rays, grid) & ~is_beside,
        certainty=grid.certainty(grid.range_m()),
    )


def _central(positions: Floats, within: float) -> Floats:
    """(k, 2): those of (n, 2) positions that are near the middle of their cell, along both axes."""
    from_middle = np.abs(positions - np.rint(positions))
    is_central = (from_middle <= within).all(axis=1)
    central: Floats = positions[is_central]
    return central


def _obstacle(seen: Seen, known: Window) -> Singles:
    """(w, h): how much the cells are obstacles."""
    is_seen = seen.is_hit | seen.is_clear | seen.is_road
    certainty = np.where(is_seen, seen.certainty, 0.0)
    return blended(known.column(PlaceColumn.OBSTACLE), seen.is_hit.astype(np.float64), certainty)


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

    by_rays = np.where(clear_between & same_ground, RAY_CERTAINTY, 0.0)
    sure = np.where(road_between, 1.0, by_rays)
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
