"""Routes to targets on the ground: which come first, and what a route costs now."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.graph.window import LINK_OFFSETS
from cogmap.services.codelets.planning.activation import Field, climb, spread_over
from cogmap.services.codelets.planning.network import PlaceNetwork
from cogmap.services.codelets.planning.search.links import Links
from cogmap.services.codelets.planning.targets import Cell, Target


class Route(NamedTuple):
    """The cells of a route's place nodes, (n, 2), and the length of its links by their weights."""

    cells: Indices
    length_m: float


class Visit(NamedTuple):
    """A target, and the activation that spreads from it over a network."""

    target: Target
    cell: Cell
    field: Field
    network: PlaceNetwork


def visits(network: PlaceNetwork, targets: list[Target]) -> list[Visit]:
    """The targets that have a place, with their activation."""
    placed = [(target, target.cell) for target in targets if target.cell is not None]
    if not placed:
        return []

    links = Links(network)
    found = []
    for target, cell in placed:
        field = spread_over(links, np.array([cell]))
        found.append(Visit(target, cell, field, network))

    return found


def lengths_m(network: PlaceNetwork, start: Cell, found: list[Visit]) -> Floats:
    """(n + 1, n + 1): lengths of the shortest routes between `start`, which is first, and visits;
    infinite where there is none.
    """
    cells = [start, *(visit.cell for visit in found)]
    origin = np.array(network.origin)
    i, j = (np.array(cells) - origin).T

    lengths = np.zeros((len(cells), len(cells)))
    for number, visit in enumerate(found, start=1):
        lengths[:, number] = visit.field.distance_m[i, j]
        lengths[number, :] = lengths[:, number]

    return lengths


def route_to(start: Cell, visit: Visit) -> Route | None:
    """The route that follows the activation of a visit; None where none arrives."""
    cells = climb(visit.network, visit.field, start)
    if cells is None:
        return None

    return Route(cells, cost_m(visit.network, cells))


def cost_m(network: PlaceNetwork, cells: Indices) -> float:
    """The length of a route of (n, 2) neighbouring cells by the weights of its links; infinite
    where one is cut, or leads outside.
    """
    if len(cells) < 2:
        return 0.0

    inside = cells - np.array(network.origin)
    if (inside < 0).any() or (inside >= network.shape).any():
        return float("inf")

    weights = _weights(network, inside)
    if not weights.all():
        return float("inf")

    steps = np.hypot(*np.diff(cells, axis=0).T) * network.cell_m
    return float((steps / weights).sum())


def _weights(network: PlaceNetwork, inside: Indices) -> Floats:
    """(n - 1,): the weights of the links of a route by (n, 2) indices; 0 where there is none."""
    here = inside[:-1]
    there = inside[1:]
    weights = np.zeros(len(here))
    for number, offset in enumerate(LINK_OFFSETS):
        of_link = network.weights[number]
        forth = (there - here == offset).all(axis=1)
        back = (here - there == offset).all(axis=1)
        weights[forth] = of_link[tuple(here[forth].T)]
        weights[back] = of_link[tuple(there[back].T)]

    return weights
