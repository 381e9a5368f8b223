"""The boundary codelet: links that cross where the road ends, or what stands there, are cut (paper
§5.5: links near boundaries have weight 0).

Evidence accumulates over sightings, so that one mistaken view cuts nothing and what was blocked is
free again once it is seen to be.
"""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, LINK_OFFSETS, WEIGHT_COLUMNS
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, PlaceColumn, Self
from cogmap.services.codelets.mapping.edges import cut_links, edges_of
from cogmap.services.codelets.mapping.evidence import accumulated, blended, weights_of
from cogmap.services.codelets.mapping.local_grid import LocalGrid
from cogmap.services.codelets.mapping.rays import clear_cells, rays_of

# The distance up to which links are cut or freed by what is seen: from 35 m the precision of
# boundaries fell from 0.94 to 0.82 in a town of the benchmark `explore`.
REACH_M = 25.0
# In cells, from the middle of one along both axes: road there is road at the place node, and an
# edge there is right beside it.
ROAD_WITHIN = 0.35
BESIDE_WITHIN = 0.2
# Ground is of one kind if it differs by less, from 0 to 1 for road. A ray between two place nodes
# counts half as much as road at both, for it passes over kerbs.
ROAD_STEP = 0.25
RAY_CERTAINTY = 0.5
WRITTEN = (*EVIDENCE_COLUMNS, *WEIGHT_COLUMNS, PlaceColumn.OBSTACLE)
COLUMNS = (*WRITTEN, PlaceColumn.ROAD)


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task in each cycle whose view shows where the road ends, or what stands around."""
    ends = context.percepts.road_boundary_m.shape[0]
    rays = 0 if context.scan is None else context.scan.range_m.shape[0]
    if not ends and not rays:
        return []

    task = context.task(
        CODELET.name, about=[SELF_ID], with_road=True, with_boundary=True, with_scan=True
    )
    return [task]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Compute new evidence and weights of the links around the agent, and the obstacles there; none
    while the agent is lost.
    """
    agent = graph.agent
    if agent is None or task.road_m is None or task.road_boundary_m is None:
        raise MessageError(f"task {task.task_id}: no self node, or no road points")
    if agent.misfits.is_lost:
        return Answer()

    grid = LocalGrid.around(agent, graph.cell_m(agent.map), REACH_M)
    known = graph.places.window(agent.map, COLUMNS, grid.extent)
    road_m = np.asarray(task.road_m.numpy(), np.float64)
    rays = rays_of(task.scan, road_m, grid)
    edges = edges_of(np.asarray(task.road_boundary_m.numpy(), np.float64), rays, grid)

    # Whether a place node right beside an edge is before or behind it no view can decide.
    certainty = grid.certainty(grid.range_m())
    is_beside = grid.has(_central(edges.middles(), BESIDE_WITHIN))
    is_road = grid.has(_central(grid.positions(road_m), ROAD_WITHIN)) & ~is_beside
    is_clear = clear_cells(rays, grid) & ~is_beside
    is_hit = grid.has(rays.hits())

    known_road = np.maximum(known.column(PlaceColumn.ROAD), is_road)
    free = _free(is_road, is_clear, known_road) * certainty
    evidence = accumulated(known.evidence(), cut_links(edges, grid), free)
    has_changed = evidence != known.evidence()
    weights = np.where(has_changed, weights_of(evidence), known.weights())

    seen_by = np.where(is_hit | is_clear | is_road, certainty, 0.0)
    obstacle = blended(known.column(PlaceColumn.OBSTACLE), is_hit.astype(np.float64), seen_by)
    after = np.concatenate([evidence, weights, obstacle[None]])
    return Answer(grid.changed(WRITTEN, known.values[: len(WRITTEN)], after))


CODELET = Codelet(
    name="boundary",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, *COLUMNS}),
    writes=frozenset(WRITTEN),
)


def _central(positions: Floats, within: float) -> Floats:
    """Choose the (k, 2) of (n, 2) positions near the middle of their cell, along both axes."""
    from_middle = np.abs(positions - np.rint(positions))
    is_central = (from_middle <= within).all(axis=1)
    central: Floats = positions[is_central]
    return central


def _free(is_road: Booleans, is_clear: Booleans, road: Singles) -> Floats:
    """Compute which links are seen to be free, (4, w, h), by how sure that is, 0 to 1.

    A link between two place nodes that are both seen as road is free. A ray passes over a kerb: so
    a ray through both place nodes counts less, and only if the ground at both is of one kind.
    """
    here = np.stack([is_road, is_clear, road])
    _, width, height = here.shape
    padded = np.pad(here, [(0, 0), (1, 1), (1, 1)])
    there = np.stack(
        [
            padded[:, 1 + di : 1 + di + width, 1 + dj : 1 + dj + height]
            for di, dj in LINK_OFFSETS.tolist()
        ]
    )

    road_between = (here[0] > 0) & (there[:, 0] > 0)
    clear_between = (here[1] > 0) & (there[:, 1] > 0)
    same_ground = np.abs(road - there[:, 2]) < ROAD_STEP
    by_rays = np.where(clear_between & same_ground, RAY_CERTAINTY, 0.0)
    return np.where(road_between, 1.0, by_rays)
