"""The Dirichlet-process mixture of objects: how probable a partition into clusters is (paper §5.3).

A cluster is a sub-map. The logarithm of a partition's probability is a sum over its clusters:

- **position**: the Dirichlet process' prior of a cluster's size (Ferguson 1973) with positions that
  are Gaussian, its mean and covariance having a normal-inverse-Wishart prior;
- **spacing**: the logarithm of the distance to neighbours, which is normal, with a normal-gamma
  prior: quarters differ in how densely they are built, whatever their shape;
- **function**: multinomial, with a Dirichlet prior.

All parameters are integrated out. To this comes a sum over pairs of neighbours:

- **boundary**: a boundary between two neighbours is frequent if their clusters differ and rare if
  they are one, as in a stochastic block model (Holland, Laskey and Leinhardt 1983);
- **gap**: open ground between them, much wider than from other neighbours, is rare in a cluster.

Each feature's share is multiplied by its weight, which is what one observation of it counts for:
neighbouring objects are no independent evidence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.sub_maps.config import Config

# The model was developed on made-up towns (benchmarks/map_structure/towns.py), of other seeds than
# the benchmark's.
# The extent of a sub-map before any object is known: the standard deviation of its objects'
# positions.
SUB_MAP_SD_M = 50.0
# The concentration of the prior over a sub-map's mix of functions, for each: Jeffreys' prior.
FUNCTION_CONCENTRATION = 0.5
# The shares of neighbours with a boundary between them, within a sub-map and between two.
CROSSED_WITHIN = 0.05
CROSSED_BETWEEN = 0.6
# Weak priors: of some objects' worth.
MEAN_PRIOR_COUNT = 1e-3
SCATTER_PRIOR_COUNT = 4.0
SPACING_MEAN_PRIOR_COUNT = 0.01
SPACING_PRIOR_COUNT = 4.0
SPACING_PRIOR_SD = 0.25
# A gap counts from twice the spacing on: the logarithm of a normal density with this standard
# deviation in the logarithm of the gap, down to a bound, as one gap is not to outweigh all else.
USUAL_GAP = math.log(2.0)
GAP_SD = 0.35
MIN_GAP_BOND = -10.0

COUNT = 0
SUM = slice(1, 3)
SQUARES = slice(3, 6)
SPACING_SUM = 6
SPACING_SQUARES = 7
FUNCTIONS = 8


class Scene(NamedTuple):
    """The objects to be clustered: (n, d) sufficient statistics of objects, the (e, 2) pairs of
    neighbours, and the (e,) bonds between those.
    """

    rows: Floats
    edges: Indices
    bonds: Floats

    def part(self, members: Indices) -> Scene:
        """Return the scene of some of the objects, (m,), alone."""
        number = np.full(len(self.rows), -1)
        number[members] = np.arange(len(members))

        renumbered = number[self.edges]
        is_inside = (renumbered >= 0).all(axis=1)
        return Scene(self.rows[members], renumbered[is_inside], self.bonds[is_inside])

    def within(self, labels: Indices) -> Scene:
        """Return the scene if only objects of one cluster are neighbours."""
        is_within = labels[self.edges[:, 0]] == labels[self.edges[:, 1]]
        return Scene(self.rows, self.edges[is_within], self.bonds[is_within])

    def merged(self, pieces: Indices) -> Scene:
        """Return the scene if the objects of each piece, (n,) from 0, are one."""
        ends = pieces[self.edges]
        is_between = ends[:, 0] != ends[:, 1]
        return Scene(summed(self.rows, pieces), ends[is_between], self.bonds[is_between])


def rows_of(positions_m: Floats, functions: Indices, kinds: int) -> Floats:
    """Return (n, 8 + kinds) sufficient statistics of objects; those of a cluster are their sum.

    They are 1, x, y, xx, xy, yy, the spacing s, ss, both 0 as yet, and 1 in the column of the
    function, which is from 0 to `kinds` - 1, or -1 if it is unknown.
    """
    x_m, y_m = positions_m.T
    rows = np.zeros((len(positions_m), FUNCTIONS + kinds))
    rows[:, COUNT] = 1.0
    rows[:, SUM] = positions_m
    rows[:, SQUARES] = np.column_stack([x_m**2, x_m * y_m, y_m**2])

    known = np.flatnonzero(functions >= 0)
    rows[known, FUNCTIONS + functions[known]] = 1.0
    return rows


def summed(rows: Floats, labels: Indices) -> Floats:
    """Compute the (k, d) sums of (n, d) rows by label, from 0 to k - 1."""
    _, columns = rows.shape
    clusters = int(labels.max(initial=-1)) + 1
    place = labels[:, None] * columns + np.arange(columns)

    sums = np.bincount(place.ravel(), rows.ravel(), clusters * columns)
    return sums.astype(np.float64).reshape(clusters, columns)


@dataclass(frozen=True)
class Mixture:
    """The mixture with its weights and priors."""

    config: Config

    def log_probability(self, scene: Scene, labels: Indices) -> float:
        """Compute the log probability of a partition, (n,) labels, but for a constant."""
        evidence = self.log_evidence(summed(scene.rows, labels)).sum()
        is_together = labels[scene.edges[:, 0]] == labels[scene.edges[:, 1]]
        return float(evidence + scene.bonds[is_together].sum())

    def log_evidence(self, statistics: Floats) -> Floats:
        """Compute what each of k clusters adds to the logarithm of the probability, (k,), by its
        sufficient statistics, (k, d); 0 for one without objects.
        """
        weights = self.config
        is_empty = statistics[:, COUNT] < 0.5
        count = np.where(is_empty, 1.0, statistics[:, COUNT])

        evidence = np.full(len(count), math.log(weights.concentration))
        evidence += weights.position_weight * _log_positions(statistics, count)
        evidence += weights.spacing_weight * _log_spacings(statistics, count)
        evidence += weights.function_weight * _log_functions(statistics)

        evidence[is_empty] = 0.0
        return evidence

    def bonds(self, is_crossed: Booleans, gaps: Floats) -> Floats:
        """Compute by how much more probable it is that two neighbours are of one cluster than of
        two, as a logarithm, (e,): by whether a boundary is between them, and by the logarithm of
        how far apart they are over the spacing of objects there.
        """
        crossed = math.log(CROSSED_WITHIN / CROSSED_BETWEEN)
        clear = math.log((1 - CROSSED_WITHIN) / (1 - CROSSED_BETWEEN))
        by_boundary = self.config.boundary_weight * np.where(is_crossed, crossed, clear)

        excess = np.maximum(gaps - USUAL_GAP, 0.0) / GAP_SD
        by_gap = self.config.gap_weight * np.maximum(-(excess**2) / 2, MIN_GAP_BOND)
        bonds: Floats = by_boundary + by_gap
        return bonds


def _log_positions(statistics: Floats, count: Floats) -> Floats:
    """Compute the logarithm of the marginal likelihood of positions, and of the prior of the sizes
    of clusters, (k,).
    """
    scale_m2 = SUB_MAP_SD_M**2 * SCATTER_PRIOR_COUNT
    mean_count = MEAN_PRIOR_COUNT + count
    degrees = SCATTER_PRIOR_COUNT + count
    sum_x, sum_y = statistics[:, SUM].T
    xx, xy, yy = statistics[:, SQUARES].T

    xx = scale_m2 + xx - sum_x**2 / mean_count
    xy = xy - sum_x * sum_y / mean_count
    yy = scale_m2 + yy - sum_y**2 / mean_count
    determinant = np.maximum(xx * yy - xy**2, 1e-9)

    before = _log_gamma_2(SCATTER_PRIOR_COUNT) - SCATTER_PRIOR_COUNT * math.log(scale_m2)
    after = _log_gamma_2(degrees) - degrees / 2 * np.log(determinant)
    density = after - before - count * math.log(math.pi)
    mean = np.log(MEAN_PRIOR_COUNT / mean_count)

    evidence: Floats = gammaln(count) + density + mean
    return evidence


def _log_gamma_2(degrees: Floats | float) -> Floats:
    """Compute the logarithm of the bivariate gamma function at half the degrees of freedom, but for
    its constant.
    """
    half = np.asarray(degrees) / 2
    logarithm: Floats = gammaln(half) + gammaln(half - 0.5)
    return logarithm


def _log_spacings(statistics: Floats, count: Floats) -> Floats:
    """Compute the logarithm of the marginal likelihood of spacings, (k,)."""
    mean_count = SPACING_MEAN_PRIOR_COUNT + count
    total = statistics[:, SPACING_SUM]
    scatter = statistics[:, SPACING_SQUARES] - total**2 / mean_count

    shape_before = SPACING_PRIOR_COUNT / 2
    shape = shape_before + count / 2
    rate_before = shape_before * SPACING_PRIOR_SD**2
    rate = rate_before + np.maximum(scatter, 0.0) / 2

    before = gammaln(shape_before) - shape_before * math.log(rate_before)
    after = gammaln(shape) - shape * np.log(rate)
    mean = np.log(SPACING_MEAN_PRIOR_COUNT / mean_count) / 2
    evidence: Floats = after - before + mean - count / 2 * math.log(2 * math.pi)
    return evidence


def _log_functions(statistics: Floats) -> Floats:
    """Compute the logarithm of the marginal likelihood of the functions that are known, (k,)."""
    counts = statistics[:, FUNCTIONS:]
    kinds = counts.shape[1]
    if not kinds:
        return np.zeros(len(counts))

    known = counts.sum(axis=1)
    prior = FUNCTION_CONCENTRATION
    each = gammaln(prior + counts) - gammaln(prior)
    together = gammaln(prior * kinds) - gammaln(prior * kinds + known)
    evidence: Floats = each.sum(axis=1) + together
    return evidence
