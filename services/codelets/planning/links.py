"""The links of a place network as a sparse matrix of costs, kept from one plan to the next."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from cogmap.geometry.arrays import Floats, Indices
from services.codelets.planning.network import LINK_OFFSETS, PlaceNetwork

# Costs are multiples of this, so that their sums are exact and ties are ties on every machine.
COST_UNIT_M = 2.0**-20


def link_costs_m(network: PlaceNetwork) -> Floats:
    """(4, width, height): length over weight of each link, inf where it is not traversable or leads
    out of the network."""
    lengths_m = network.cell_m * np.hypot(*LINK_OFFSETS.T)
    weights = network.weights.astype(np.float64)

    costs_m = np.full(weights.shape, np.inf)
    np.divide(lengths_m[:, None, None], weights, out=costs_m, where=weights > 0)
    _cut_outward(costs_m)
    return np.round(costs_m / COST_UNIT_M) * COST_UNIT_M


def _cut_outward(costs_m: Floats) -> None:
    """Cut the links that lead out of the network."""
    for costs, (di, dj) in zip(costs_m, LINK_OFFSETS.tolist(), strict=True):
        if di == 1:
            costs[-1] = np.inf
        if di == -1:
            costs[0] = np.inf
        if dj == 1:
            costs[:, -1] = np.inf


def link_matrix(network: PlaceNetwork) -> sparse.csr_matrix:
    """(n, n): the cost in metres of each link, both ways; node [i, j] is row i * height + j."""
    width, height = network.shape
    count = width * height
    nodes = np.arange(count).reshape(width, height)
    costs_m = link_costs_m(network)

    links, i, j = np.nonzero(np.isfinite(costs_m))
    di, dj = LINK_OFFSETS[links].T
    here: Indices = nodes[i, j]
    there: Indices = nodes[i + di, j + dj]
    costs = costs_m[links, i, j]

    rows = np.concatenate([here, there])
    columns = np.concatenate([there, here])
    both = np.concatenate([costs, costs])
    return sparse.csr_matrix((both, (rows, columns)), shape=(count, count))
