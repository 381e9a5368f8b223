"""Decides of which individual object each percept is a sighting: by place, look and size together.

Against every object of the map stand two possibilities: that the percept is of one that was not met
yet, and that it is a mistake. What cannot be told yet waits for the next views. That the agent is
elsewhere than it believes is a possibility too, and the likelier, the longer it is since something
fitted its map: then percepts are of the objects that they look like, wherever these stand.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import count
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.geometry.se2 import rotate
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import OVERLAP
from cogmap.graph.likeness import is_new_side, likeness
from cogmap.schemas import nodes
from cogmap.schemas.array import Array
from cogmap.schemas.nodes import Object, Self, individual_label
from cogmap.schemas.sensing import MAX_BEARING_SD_RAD, Percept, Percepts
from cogmap.services.workspace.association.beliefs import (
    BELIEVED,
    FARTHEST_M,
    Belief,
    Possible,
    belief_of,
)
from cogmap.services.workspace.association.crowding import (
    log_crowding,
    nearest_seen_m2,
)
from cogmap.services.workspace.association.joint import NONE, associate
from cogmap.services.workspace.association.known_objects import KnownObjects
from cogmap.services.workspace.association.looks import Look, look_of
from cogmap.services.workspace.association.tracking import mapped, tracked

NEAR_M = 12.0
"""An object stands at most so far from where a percept of it is seen, beside what is uncertain."""

P_SEEN = 0.9
"""How likely perception finds an object that is in view (detect_recall)."""

NEW_PER_VIEW = 0.2
"""Objects in a view that were not met before: as many as an exploring agent meets in a town."""

MISTAKES_PER_VIEW = 0.1
"""Percepts of a view that are of nothing (1 - detect_precision, of three percepts)."""

CERTAIN = 0.9
"""A percept that is less likely of its object than so waits for the next views."""

KIDNAPPED_PER_S = 1 / 600
"""How often the agent is elsewhere than it believes, in the life of a robot that is carried about
now and then."""

P_IS_HERE = 20.0
"""The agent is where it believes if what it sees is so many times likelier there than elsewhere."""

MAX_CANDIDATES = 8
"""Objects that a percept is compared with at most: the nearest."""

GATE = 3.0
"""Standard deviations within which nearly all normal errors are."""

MAX_REACH_M = 100.0
"""Objects are looked for so far around at most, so that a lost agent does not look at all: farther,
but within its uncertainty, only the one that a percept looks like most."""

ESTABLISHED = 3
"""An object that was seen so often stands where it is."""

LARGEST_SD_M = 3.5
"""With a larger standard deviation a place is none: a third of how far buildings stand apart. With
more, more of the buildings are on the map and fewer of these right: in three towns to develop with
0.92 and 0.80 with 4.0, 0.87 and 0.83 with 3.0, all else as it was then."""


class Associated(NamedTuple):
    """A view's percepts, each with the label of the object that it is of, and those that wait: each
    is of a known object, but it cannot be told yet of which, and is labelled as of the likeliest.
    """

    percepts: Percepts
    waiting: tuple[Percept, ...] = ()


class Individuals:
    """The individuals of the map, and the percepts that are taken to be of them."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self.known = KnownObjects(graph)

    def labelled(self, percepts: Percepts, motions: Array) -> Associated:
        """Label each of `percepts` by the individual object that it is of, beside those that wait;
        leave out mistakes. One whose source knows the individual, as by a barcode, has a label.

        `motions` are those since the self node was moved last.
        """
        agent = self._graph.agent
        identified = [percept for percept in percepts.objects if percept.label]
        seen = [percept for percept in percepts.objects if not percept.label]
        new_labels = (individual_label(self._graph.cycle + 1, number) for number in count())
        if not seen:
            return Associated(percepts)
        if agent is None:
            first = [msgspec.structs.replace(each, label=next(new_labels)) for each in seen]
            return Associated(msgspec.structs.replace(percepts, objects=[*identified, *first]))

        belief = belief_of(agent, np.asarray(motions.numpy(), np.float64))
        looks = [look_of(percept, self.known) for percept in seen]
        measured = [_with_true_range(percept, agent.range_gain) for percept in seen]
        candidates, possible = self._possible(measured, looks, agent, belief)
        found = associate(possible, belief)
        is_known = found.objects != NONE
        is_here = bool(is_known.all()) or _is_here(
            possible, looks, belief, percepts.stamp_ns, agent
        )

        taken = {candidates[number].label for number in found.objects.tolist() if number != NONE}
        taken |= {percept.label for percept in identified}
        objects = list(identified)
        waiting = []
        for place, percept in enumerate(seen):
            number = int(found.objects[place])
            probability = float(found.probability[place])
            if probability < CERTAIN:
                shares = found.shares[place]
                if 1 - shares.get(NONE, 0.0) >= CERTAIN:
                    waiting.append(_one_of(percept, candidates, shares, belief))
                continue

            if number != NONE:
                node = candidates[number]
                objects.append(_of(percept, node, probability))
                continue

            alike = looks[place].alike
            if not is_here and alike is not None and alike.label not in taken:
                taken.add(alike.label)
                objects.append(_of(percept, alike, probability))
            elif is_placed(percept) and self._stands_clear(measured[place], agent, belief):
                label = next(new_labels)
                objects.append(msgspec.structs.replace(percept, label=label))

        entered = msgspec.structs.replace(percepts, objects=objects)
        return Associated(entered, tuple(waiting))

    def _possible(
        self, seen: Sequence[Percept], looks: Sequence[Look], agent: Self, belief: Belief
    ) -> tuple[list[Object], list[Possible]]:
        """Find the objects that each percept may be of, and how much it looks like them."""
        candidates: dict[str, Object] = {}
        in_reach = []
        for percept, look in zip(seen, looks, strict=True):
            near = self._in_reach(percept, agent, belief)
            if look.alike is not None and _is_beyond(look.alike, near, percept, agent, belief):
                near.append(look.alike)
            in_reach.append(near)
            candidates |= {node.label: node for node in near}

        known = list(candidates.values())
        number_of = {label: number for number, label in enumerate(candidates)}
        on_map = mapped(known)
        by_path = tracked(known, on_map, agent, belief.covariances[BELIEVED])
        # In the order of Source.
        places_m = np.stack([by_path.mean_m, on_map.mean_m])
        own_m2 = np.stack([by_path.covariance_m2, on_map.covariance_m2])

        possible = []
        for percept, look, near in zip(seen, looks, in_reach, strict=True):
            numbers = np.array([number_of[node.label] for node in near], np.int64)
            likenesses = np.array([P_SEEN * likeness(percept, node) for node in near])
            one = Possible(
                percept=percept,
                places_m=places_m[:, numbers],
                own_m2=own_m2[:, numbers],
                numbers=numbers,
                log_likeness=np.log(likenesses),
                log_none=math.log((NEW_PER_VIEW + MISTAKES_PER_VIEW) * look.of_another),
            )
            possible.append(one)

        return known, possible

    def _in_reach(self, percept: Percept, agent: Self, belief: Belief) -> list[Object]:
        """Return the objects of the agent's map that stand where a percept may be of them, the
        nearest MAX_CANDIDATES.
        """
        middle_m, within_m = _reach(percept, belief)
        x_m, y_m = middle_m
        nodes = self.known.near(agent.map, x_m, y_m, min(within_m, MAX_REACH_M))
        nodes.sort(key=lambda node: (math.dist(middle_m, (node.x_m, node.y_m)), node.label))
        return nodes[:MAX_CANDIDATES]

    def _stands_clear(self, percept: Percept, agent: Self, belief: Belief) -> bool:
        """Decide whether a percept is of something that may stand where it is seen: two things do
        not stand in one place. If its place is not known, it may.
        """
        if not percept.has_place:
            return True

        at_m = place_m(percept, belief)
        for node in self._in_reach(percept, agent, belief):
            apart_m = OVERLAP * (percept.width_m + node.width_m) / 2
            is_established = node.sightings >= ESTABLISHED
            if is_established and math.dist(at_m, (node.x_m, node.y_m)) < apart_m:
                return False

        return True


def as_entered(percepts: Percepts, graph: Graph) -> Percepts:
    """Return `percepts` by the labels with which they entered the graph in this cycle, before the
    workspace was interrupted. Those that waited inform this cycle no more.
    """
    label_of = {}
    for node in graph.of_kind(nodes.Percept):
        if node.cycle == graph.cycle:
            label_of[node.bearing_rad, node.range_m] = node.label

    objects = []
    for percept in percepts.objects:
        label = label_of.get((percept.bearing_rad, percept.range_m))
        if label is not None:
            objects.append(msgspec.structs.replace(percept, label=label))

    return msgspec.structs.replace(percepts, objects=objects)


def place_m(percept: Percept, belief: Belief) -> tuple[float, float]:
    """Return where something is seen from the pose that is believed."""
    x_m, y_m, heading_rad = belief.means[0].tolist()
    direction_rad = heading_rad + percept.bearing_rad
    return (
        x_m + percept.range_m * math.cos(direction_rad),
        y_m + percept.range_m * math.sin(direction_rad),
    )


def _reach(percept: Percept, belief: Belief) -> tuple[tuple[float, float], float]:
    """Return the middle of where a percept's object may stand, and how far from it, in m."""
    x_m, y_m, _ = belief.means[0].tolist()
    middle_m = (x_m, y_m)
    sd_m = math.sqrt(float(belief.covariances[:, 0, 0].max() + belief.covariances[:, 1, 1].max()))
    within_m = percept.range_m if percept.has_range else FARTHEST_M
    if percept.has_place:
        middle_m = place_m(percept, belief)
        within_m = 0.0

    return middle_m, within_m + NEAR_M + GATE * math.hypot(percept.range_sd_m, sd_m)


def _is_beyond(
    node: Object, near: Sequence[Object], percept: Percept, agent: Self, belief: Belief
) -> bool:
    """Decide whether an object is not among those `near`, but stands on the agent's map where the
    percept may be of it.
    """
    if node.map != agent.map or any(node.id == each.id for each in near):
        return False

    middle_m, within_m = _reach(percept, belief)
    return math.dist(middle_m, (node.x_m, node.y_m)) <= within_m


def _is_here(
    possible: Sequence[Possible], looks: Sequence[Look], belief: Belief, now_ns: int, agent: Self
) -> bool:
    """Decide whether the agent is where it believes, by how likely what it sees is there, and how
    likely at any other place of its map. What is too far to enter the map says nothing of that: it
    may well stand here and be on no map.
    """
    fit = agent.misfits
    certain_ns = max(fit.last_fit_ns, fit.not_elsewhere_ns, 0)
    unsure_s = max(0.0, (now_ns - certain_ns) / 1e9)
    p_elsewhere = min(KIDNAPPED_PER_S * unsure_s, 0.5)
    placed = [place for place, each in enumerate(possible) if is_placed(each.percept)]
    if p_elsewhere == 0.0 or not placed:
        return True

    log_elsewhere = math.log(p_elsewhere)
    for row, place in enumerate(placed):
        percept = possible[place].percept
        before = [possible[other].percept for other in placed[:row]]
        nearest_m2 = np.array([nearest_seen_m2(percept, before)])
        crowding = math.exp(log_crowding(percept, nearest_m2)[0])
        none = (NEW_PER_VIEW + MISTAKES_PER_VIEW) * looks[place].of_another * crowding
        log_elsewhere += math.log(P_SEEN * looks[place].of_any + none)

    here = associate([possible[place] for place in placed], belief)
    return here.log_evidence - log_elsewhere > math.log(P_IS_HERE)


def is_placed(percept: Percept) -> bool:
    """Decide whether something that was not met yet may enter the map where it is seen: it waits
    until it is nearer if its place says nothing of which of its neighbours it is.
    """
    if not percept.has_place:
        return True

    across_sd_m = percept.range_m * percept.bearing_sd_rad
    return math.hypot(percept.range_sd_m, across_sd_m) <= LARGEST_SD_M


def _with_true_range(percept: Percept, range_gain: float) -> Percept:
    """Return a percept with its range as it is, if ranges are seen too large by a share."""
    if not percept.has_range:
        return percept
    return msgspec.structs.replace(percept, range_m=percept.range_m / (1 + range_gain))


def _one_of(
    percept: Percept, known: Sequence[Object], shares: Mapping[int, float], belief: Belief
) -> Percept:
    """Label a percept as of the likeliest of the `known` objects, by number, that it may be of; it
    states its place as badly as the others stand from that one, seen from the pose that is
    believed.
    """
    p_known = 1 - shares.get(NONE, 0.0)
    numbers = [number for number in shares if number != NONE]
    weights = np.array([shares[number] for number in numbers]) / p_known
    likeliest = known[numbers[int(weights.argmax())]]

    direction_rad = float(belief.means[0, 2]) + percept.bearing_rad
    away_m = np.array([(known[each].x_m, known[each].y_m) for each in numbers])
    away_m -= (likeliest.x_m, likeliest.y_m)
    seen_m = rotate(away_m, -direction_rad)
    along_m2, across_m2 = (weights @ np.square(seen_m)).tolist()

    bearing_rad2 = percept.bearing_sd_rad**2 + across_m2 / percept.range_m**2
    return msgspec.structs.replace(
        percept,
        label=likeliest.label,
        certainty=min(1.0, p_known),
        range_sd_m=math.sqrt(percept.range_sd_m**2 + along_m2),
        bearing_sd_rad=min(math.sqrt(bearing_rad2), MAX_BEARING_SD_RAD),
        appearance=None,
    )


def _of(percept: Percept, node: Object, probability: float) -> Percept:
    """Label a percept as of an object; an appearance that adds none to those known is left out."""
    appearance = percept.appearance
    if appearance is not None and not is_new_side(appearance, node.appearances):
        appearance = None

    return msgspec.structs.replace(
        percept, label=node.label, certainty=probability, appearance=appearance
    )
