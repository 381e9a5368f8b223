"""What the map that an agent has made is worth, beside the town as it was built."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.explore.boundaries import BoundaryScore, boundary_score
from benchmarks.explore.trials import centre_lines_m
from benchmarks.harness import pose_array
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from, transform_to
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, ROAD_FROM, WEIGHT_COLUMNS
from cogmap.schemas.nodes import ROOT_MAP, PlaceColumn
from cogmap.schemas.sensing import TrueTown

SEEN_WITHIN_M = 1.5
CORNERS = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])


def road_m(graph: Graph, start: Floats) -> Floats:
    """Return the (n, 2) place nodes that the agent has seen as road, in the true frame; `start` is
    the true pose (3,) where the agent's own frame begins.
    """
    extent = graph.places.extent(ROOT_MAP)
    window = graph.places.window(ROOT_MAP, [PlaceColumn.ROAD], extent)
    is_road = window.column(PlaceColumn.ROAD) >= ROAD_FROM

    cells = np.argwhere(is_road) + np.array(window.origin)
    return transform_from(start, cells * graph.cell_m())


def explored_share(graph: Graph, town: TrueTown, start: Floats) -> float:
    """Return the share of street centre lines that the map has as road, within SEEN_WITHIN_M."""
    known_m = road_m(graph, start)
    if not len(known_m):
        return 0.0

    away_m, _ = cKDTree(known_m).query(centre_lines_m(town))
    is_seen = away_m <= SEEN_WITHIN_M
    return float(is_seen.mean())


def score_boundaries(graph: Graph, town: TrueTown, start: Floats) -> BoundaryScore:
    """Score how well the links that are cut agree with the town's kerbs, walls and obstacles."""
    kerbs_m = np.asarray(town.kerbs_m.numpy(), np.float64)
    walls_m = np.asarray(town.walls_m.numpy(), np.float64)
    segments_m = [kerbs_m, walls_m]
    for obstacle in town.obstacles:
        half_m = np.array([obstacle.length_m, obstacle.width_m]) / 2
        corners_m = transform_from(pose_array(obstacle.pose), CORNERS * half_m)
        segments_m.append(np.hstack([corners_m, np.roll(corners_m, -1, axis=0)]))

    on_map_m = transform_to(start, np.vstack(segments_m).reshape(-1, 2))
    extent = graph.places.extent(ROOT_MAP)
    window = graph.places.window(ROOT_MAP, (*WEIGHT_COLUMNS, *EVIDENCE_COLUMNS), extent)
    return boundary_score(window, graph.cell_m(), on_map_m.reshape(-1, 4))
