"""Towns with known districts, made up to measure how well sub-maps find them again.

A town is a plane of plots, the cells of a Voronoi diagram of random sites. Districts grow over
neighbouring plots at different speeds, so that they adjoin, differ in size, and are neither convex
nor Gaussian. Each has its own density of objects and its own mix of functions; all mixes are drawn
around one of the town, so that every function occurs in several districts.

Six in seven borders between two districts carry a boundary: a river, a wall or a main road, with
gaps where it is crossed. The others carry none: there, two districts differ in density and mix
alone. Some borders of plots inside a district carry a boundary too. An object's position errs as a
robot's map does: by a noise of its own, and by an error that varies slowly over the town and moves
boundaries alike. Of some objects the function is unknown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import Voronoi, cKDTree

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.polylines import nearest_on_pieces

FUNCTIONS = 8
UNKNOWN = -1
UNKNOWN_SHARE = 0.1
DISTRICTS = (3, 13)
PLOTS_A_DISTRICT = 7
PLOT_M = 70.0
COMPACTNESS = 2
SPACINGS_M = (11.0, 26.0)
MIX_CONCENTRATION = 4.0
MIN_OBJECTS = 15

BORDER_SHARE = 0.85
INNER_SHARE = 0.08
PIECE_M = 8.0
BEND_SD_M = 1.0
GAP_M = (8.0, 18.0)
GAP_EVERY_M = (60.0, 180.0)
SETBACK_M = 4.0

POSITION_SD_M = 1.5
DRIFT_SD_M = 3.0
DRIFT_LENGTH_M = 300.0
DRIFT_WAVES = 12


@dataclass(frozen=True)
class Town:
    """Objects at (n, 2) positions with (n,) functions, UNKNOWN where there is none; the boundaries
    as (m, 2, 2) segments; and the truth: the (n,) districts.
    """

    positions_m: Floats
    functions: Indices
    boundaries_m: Floats
    districts: Indices

    def select(self, chosen: Indices) -> Town:
        """Return the same town with some of its objects, (m,), in that order."""
        return Town(
            positions_m=self.positions_m[chosen],
            functions=self.functions[chosen],
            boundaries_m=self.boundaries_m,
            districts=self.districts[chosen],
        )


class _Border(NamedTuple):
    """A straight border (2, 2) between two plots."""

    plots: tuple[int, int]
    ends_m: Floats


class _Plan(NamedTuple):
    """(p, 2) sites of plots, their borders, and the district of each plot, (p,)."""

    sites_m: Floats
    borders: list[_Border]
    district_of: Indices


def town(seed: int, districts: int | None = None, plot_m: float = PLOT_M) -> Town:
    """Make a town of 3 to 12 districts, or of that many, on plots about `plot_m` wide."""
    rng = np.random.default_rng(seed)
    count = districts or int(rng.integers(*DISTRICTS))

    # Plots, and districts that have grown over all of them.
    plots = count * PLOTS_A_DISTRICT
    side_m = plot_m * math.sqrt(plots)
    sites_m = rng.uniform(0.0, side_m, (plots, 2))
    borders = _borders(sites_m, side_m)
    plan = _Plan(sites_m, borders, _grown(plots, borders, count, rng))

    boundaries_m = _boundaries(plan, rng)
    positions_m, truth = _objects(plan, boundaries_m, rng)

    # Functions by the mixes of the districts, of some objects unknown.
    town_mix = rng.dirichlet(np.full(FUNCTIONS, 3.0))
    functions = np.full(len(truth), UNKNOWN)
    for district in np.unique(truth):
        mix = rng.dirichlet(MIX_CONCENTRATION * town_mix)
        members = truth == district
        functions[members] = rng.choice(FUNCTIONS, members.sum(), p=mix)
    functions[rng.random(len(truth)) < UNKNOWN_SHARE] = UNKNOWN

    drifted_m = _Drift(
        waves_per_m=rng.normal(0.0, 1 / DRIFT_LENGTH_M, (DRIFT_WAVES, 2)),
        amplitudes_m=rng.normal(0.0, DRIFT_SD_M * math.sqrt(2 / DRIFT_WAVES), (DRIFT_WAVES, 2)),
        phases_rad=rng.uniform(0.0, 2 * math.pi, DRIFT_WAVES),
    )
    noise_m = rng.normal(0.0, POSITION_SD_M, positions_m.shape)
    return Town(
        positions_m=drifted_m(positions_m) + noise_m,
        functions=functions,
        boundaries_m=drifted_m(boundaries_m.reshape(-1, 2)).reshape(-1, 2, 2),
        districts=truth,
    )


def _borders(sites_m: Floats, side_m: float) -> list[_Border]:
    """Find the borders between the cells of (p, 2) sites in a square; mirrored sites end them at
    its sides.
    """
    mirrored_m = [sites_m]
    for axis in (0, 1):
        for side in (0.0, 2 * side_m):
            reflected_m = sites_m.copy()
            reflected_m[:, axis] = side - reflected_m[:, axis]
            mirrored_m.append(reflected_m)

    diagram = Voronoi(np.vstack(mirrored_m))
    borders = []
    for (a, b), corners in zip(diagram.ridge_points, diagram.ridge_vertices, strict=True):
        if max(a, b) < len(sites_m):
            ends_m = diagram.vertices[corners]
            borders.append(_Border((int(a), int(b)), ends_m))

    return borders


def _grown(plots: int, borders: list[_Border], districts: int, rng: np.random.Generator) -> Indices:
    """Grow the districts, and return the one of each plot, (p,).

    From one plot each, districts annex free neighbours, in turns drawn by their speeds.
    """
    neighbours: list[list[int]] = [[] for _ in range(plots)]
    for (a, b), _ in borders:
        neighbours[a].append(b)
        neighbours[b].append(a)

    district_of = np.full(plots, -1)
    district_of[rng.choice(plots, districts, replace=False)] = np.arange(districts)
    speeds = rng.uniform(0.4, 1.6, districts)

    while (district_of < 0).any():
        district = rng.choice(districts, p=speeds / speeds.sum())
        shares = np.zeros(plots)
        for plot in np.flatnonzero(district_of < 0):
            shares[plot] = np.mean(district_of[neighbours[plot]] == district)

        if shares.any():
            chances = shares**COMPACTNESS
            district_of[rng.choice(plots, p=chances / chances.sum())] = district
        else:
            speeds[district] = 0.0

    return district_of


def _boundaries(plan: _Plan, rng: np.random.Generator) -> Floats:
    """Draw the (m, 2, 2) boundaries of most borders between districts, and of a few inside them."""
    by_pair: dict[tuple[int, int], list[Floats]] = {}
    segments_m = [np.zeros((0, 2, 2))]

    for plots, ends_m in plan.borders:
        a, b = sorted(plan.district_of[list(plots)].tolist())
        if a != b:
            by_pair.setdefault((a, b), []).append(ends_m)
        elif rng.random() < INNER_SHARE:
            segments_m.append(_with_gaps([ends_m], rng))

    for pair in sorted(by_pair):
        if rng.random() < BORDER_SHARE:
            segments_m.append(_with_gaps(by_pair[pair], rng))

    return np.concatenate(segments_m)


def _with_gaps(borders_m: list[Floats], rng: np.random.Generator) -> Floats:
    """Draw a (k, 2, 2) boundary along straight borders, a bit bent, with a gap at each crossing."""
    pieces_m = np.concatenate([_bent(ends_m, rng) for ends_m in borders_m])
    lengths_m = np.hypot(*(pieces_m[:, 1] - pieces_m[:, 0]).T)
    along_m = np.cumsum(lengths_m) - lengths_m / 2

    is_open = np.zeros(len(pieces_m), bool)
    crossing_m = rng.uniform(0.0, GAP_EVERY_M[1])
    while crossing_m < along_m[-1]:
        is_open |= np.abs(along_m - crossing_m) < rng.uniform(*GAP_M) / 2
        crossing_m += rng.uniform(*GAP_EVERY_M)

    closed: Floats = pieces_m[~is_open]
    return closed


def _bent(ends_m: Floats, rng: np.random.Generator) -> Floats:
    """Cut a straight border into (k, 2, 2) pieces whose inner corners lie a little aside."""
    along = ends_m[1] - ends_m[0]
    length_m = float(np.hypot(*along))
    count = max(1, round(length_m / PIECE_M))

    corners_m = ends_m[0] + np.linspace(0.0, 1.0, count + 1)[:, None] * along
    aside_m = rng.normal(0.0, BEND_SD_M, count - 1)
    across = np.array([-along[1], along[0]]) / max(length_m, 1e-9)
    corners_m[1:-1] += aside_m[:, None] * across
    return np.stack([corners_m[:-1], corners_m[1:]], axis=1)


def _objects(plan: _Plan, boundaries_m: Floats, rng: np.random.Generator) -> tuple[Floats, Indices]:
    """Draw (n, 2) positions and (n,) districts: each district has objects at a spacing of its own,
    some way from every boundary. A district that has room for few stays empty.
    """
    plots = cKDTree(plan.sites_m)
    low_m = plan.sites_m.min(axis=0)
    high_m = plan.sites_m.max(axis=0)
    positions_m = []
    districts = []

    for district in range(int(plan.district_of.max()) + 1):
        spacing_m = math.exp(rng.uniform(*np.log(SPACINGS_M)))

        # Irregular points over all plots, none much closer to another than the spacing.
        number = int(np.prod(high_m - low_m) / spacing_m**2 * 2)
        points_m = rng.uniform(low_m, high_m, (number, 2))
        pairs = cKDTree(points_m).query_pairs(0.75 * spacing_m, output_type="ndarray")
        is_kept = np.ones(number, bool)
        for first, second in pairs[np.lexsort(pairs.T)].tolist():
            if is_kept[first]:
                is_kept[second] = False

        scattered_m = points_m[is_kept]
        is_inside = plan.district_of[plots.query(scattered_m)[1]] == district
        inside_m = scattered_m[is_inside]
        if len(boundaries_m) and len(inside_m):
            nearest = nearest_on_pieces(boundaries_m[:, 0], boundaries_m[:, 1], inside_m)
            away_m = np.hypot(*(inside_m - nearest.foot_m).T)
            inside_m = inside_m[away_m >= SETBACK_M]

        if len(inside_m) >= MIN_OBJECTS:
            positions_m.append(inside_m)
            districts.append(np.full(len(inside_m), district))

    return np.vstack(positions_m), np.concatenate(districts)


@dataclass(frozen=True)
class _Drift:
    """An error of position that varies slowly: a sum of waves along (w, 2) directions, of random
    (w, 2) amplitudes and (w,) phases.
    """

    waves_per_m: Floats
    amplitudes_m: Floats
    phases_rad: Floats

    def __call__(self, points_m: Floats) -> Floats:
        """Return where points appear, (k, 2)."""
        angles_rad = points_m @ self.waves_per_m.T + self.phases_rad
        drifted_m: Floats = points_m + np.sin(angles_rad) @ self.amplitudes_m
        return drifted_m
