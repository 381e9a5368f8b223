"""What the map that an agent has made is worth, beside the town as it was built."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from benchmarks.explore.trials import centre_lines_m
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.graph.window import LINK_OFFSETS, WEIGHT_COLUMNS
from schemas.nodes import ROOT_MAP, PlaceColumn
from schemas.sensing import TrueTown

ROAD_FROM = 0.3
SEEN_WITHIN_M = 1.5
CUT_BELOW = 0.5
SPACING_M = 0.5
CORNERS = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])


def road_m(graph: Graph, start: Floats) -> Floats:
    """(n, 2): the place nodes that the agent has seen as road, in the true frame; `start` is the
    true pose (3,) where the agent's own frame begins.
    """
    extent = graph.places.extent(ROOT_MAP)
    window = graph.places.window(ROOT_MAP, [PlaceColumn.ROAD], extent)
    is_road = window.column(PlaceColumn.ROAD) >= ROAD_FROM

    cells = np.argwhere(is_road) + np.array(window.origin)
    return transform_from(start, cells * graph.cell_m())


def explored_share(graph: Graph, town: TrueTown, start: Floats) -> float:
    """The share of the streets' centre lines that is on the map as road, within SEEN_WITHIN_M."""
    known_m = road_m(graph, start)
    if not len(known_m):
        return 0.0

    away_m, _ = cKDTree(known_m).query(centre_lines_m(town))
    is_seen = away_m <= SEEN_WITHIN_M
    return float(is_seen.mean())


class BoundaryScore(NamedTuple):
    """How well the links that are cut agree with the town's kerbs, walls and obstacles."""

    precision: float
    recall: float


def boundary_score(graph: Graph, town: TrueTown, start: Floats) -> BoundaryScore:
    """Precision: the share of cut links whose middle is within a cell of a true boundary. Recall:
    the share of the kerbs beside road that the agent knows with a cut link within a cell.
    """
    cell_m = graph.cell_m()
    cut_m = cut_links_m(graph, start)
    kerbs_m = _points_along(town.kerbs_m.numpy())
    edges_m = [kerbs_m, _points_along(town.walls_m.numpy()), _points_along(_outlines(town))]

    beside_m, _ = cKDTree(road_m(graph, start)).query(kerbs_m)
    known_m = kerbs_m[beside_m <= cell_m]
    from_edge_m, _ = cKDTree(np.vstack(edges_m)).query(cut_m)
    from_cut_m, _ = cKDTree(cut_m).query(known_m)
    return BoundaryScore(
        precision=float((from_edge_m <= cell_m).mean()),
        recall=float((from_cut_m <= cell_m).mean()),
    )


def cut_links_m(graph: Graph, start: Floats) -> Floats:
    """(n, 2): the middles of the links that are cut, in the true frame."""
    extent = graph.places.extent(ROOT_MAP)
    window = graph.places.window(ROOT_MAP, WEIGHT_COLUMNS, extent)
    middles = []
    for weights, offset in zip(window.weights(), LINK_OFFSETS, strict=True):
        cells = np.argwhere(weights < CUT_BELOW)
        middles.append(cells + np.array(window.origin) + offset / 2)

    return transform_from(start, np.vstack(middles) * graph.cell_m())


def _points_along(segments_m: npt.NDArray[np.generic]) -> Floats:
    """(k, 2): points on (n, 4) segments, SPACING_M apart at most."""
    ends = np.asarray(segments_m, np.float64).reshape(-1, 2, 2)
    points = [np.zeros((0, 2))]
    for first, last in ends:
        count = 2 + int(np.hypot(*(last - first)) / SPACING_M)
        share = np.linspace(0, 1, count)[:, None]
        points.append(first + share * (last - first))

    return np.vstack(points)


def _outlines(town: TrueTown) -> Floats:
    """(n, 4): the sides of the obstacles."""
    sides = [np.zeros((0, 4))]
    for obstacle in town.obstacles:
        pose = np.array([obstacle.pose.x_m, obstacle.pose.y_m, obstacle.pose.heading_rad])
        half_m = np.array([obstacle.length_m, obstacle.width_m]) / 2
        corners_m = transform_from(pose, CORNERS * half_m)
        sides.append(np.hstack([corners_m, np.roll(corners_m, -1, axis=0)]))

    return np.vstack(sides)
