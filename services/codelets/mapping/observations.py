"""From where on the path each landmark was seen: what binds the map to the path (beyond the paper).

A node of kind `sighted` holds one landmark's sightings along one node of the path, one a place.
Each row of its samples is stamp_s of the place, where the landmark stood as seen from there,
forwards_m and left_m, the standard deviations of that along and across the line of sight, and the
direction of that line. Corrections do not change them: they tell what the agent sensed, from the
place of the path on.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import rotation_matrices
from schemas.array import Array
from schemas.base import Scalar
from schemas.graph import Node
from schemas.sensing import Percept
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
)

KIND = "sighted"
COLUMNS = 6
STAMP = 0
WHERE = slice(1, 3)
SPREAD = slice(3, 5)
DIRECTION = 5
# So many standard deviations off, a sighting counts half as much as one that fits: it may be of
# another landmark.
DOUBTED = 2.0
ROUNDS = 6
NO_HEADING = 1e-6


def sighted_id(number: int, label: str) -> str:
    """The name of the sightings of landmark `label` along the path's node `number`."""
    return f"{KIND}:{number}:{label}"


class Outlook(NamedTuple):
    """What the agent looks out from: a place of the path's node `number`, and how it has moved
    since then, (3,).

    `range_gain` is by how much it sees too far.
    """

    number: int
    stamp_s: float
    step: Floats
    range_gain: float


def recorded(before: Node | None, outlook: Outlook, percept: Percept) -> Node:
    """A landmark's sightings along a node of the path, with one more."""
    step = outlook.step
    direction = step[2] + percept.bearing_rad
    range_m = percept.range_m / (1 + outlook.range_gain)
    where = step[:2] + range_m * np.array([math.cos(direction), math.sin(direction)])
    row = np.array(
        [outlook.stamp_s, *where, percept.range_sd_m, range_m * percept.bearing_sd_rad, direction]
    )
    rows = row[None] if before is None else np.vstack([_rows(before), row])
    facts: dict[str, Scalar] = {"number": outlook.number, "landmark": percept.label}
    name = sighted_id(outlook.number, percept.label)
    return Node(id=name, kind=KIND, base_level=1.0, attributes=facts, samples=Array.of(rows))


def seen_from(node: Node | None, stamp_s: float) -> bool:
    """Whether the sightings have one of the place at `stamp_s`, which would be the last."""
    return node is not None and float(_rows(node)[-1, STAMP]) >= stamp_s


def _rows(node: Node) -> Floats:
    rows = (
        np.empty((0, 0)) if node.samples is None else np.asarray(node.samples.numpy(), np.float64)
    )
    if rows.ndim != 2 or rows.shape[1] != COLUMNS:
        raise MessageError(f"{node.id}: sightings whose rows are not {COLUMNS} numbers")
    return rows


class Sightings(NamedTuple):
    """m sightings: `place` (m,) on the path, `landmark` (m,) in `labels`, `where_m` (m, 2),
    `information` (m, 2, 2).
    """

    labels: tuple[str, ...]
    place: Indices
    landmark: Indices
    where_m: Floats
    information: Floats

    @classmethod
    def of(cls, nodes: Iterable[Node], stamps_s: Floats) -> Sightings:
        """Those in the nodes of kind `sighted` among `nodes`, seen from the places of the path at
        `stamps_s` (n,).
        """
        records = [node for node in nodes if node.kind == KIND]
        labels = tuple(sorted({str(node.attributes["landmark"]) for node in records}))
        rows = np.vstack([np.zeros((0, COLUMNS)), *map(_rows, records)])
        numbers = [labels.index(str(node.attributes["landmark"])) for node in records]
        landmark = np.repeat(np.array(numbers, np.int64), [len(_rows(node)) for node in records])
        after = np.searchsorted(stamps_s, rows[:, STAMP]).clip(0, max(0, len(stamps_s) - 1))
        known = (
            np.abs(stamps_s[after] - rows[:, STAMP]) < 1e-6
            if len(stamps_s)
            else np.zeros(len(rows), bool)
        )
        rows = rows[known]
        turn = rotation_matrices(rows[:, DIRECTION])
        information = turn * (rows[:, None, SPREAD].clip(1e-3) ** -2) @ turn.transpose(0, 2, 1)
        return cls(labels, after[known], landmark[known], rows[:, WHERE], information)

    def weights(self, poses: Floats, landmarks_m: Floats) -> Floats:
        """(m,) how much each counts, the path being at (n, 3) `poses` and landmarks at (k, 2):
        Cauchy's weights.
        """
        turn = rotation_matrices(poses[self.place, 2])
        seen = np.einsum("mba,mb->ma", turn, landmarks_m[self.landmark] - poses[self.place, :2])
        off = seen - self.where_m
        squared = np.einsum("ma,mab,mb->m", off, self.information, off)
        result: Floats = 1 / (1 + squared / DOUBTED**2)
        return result

    def landmarks_m(self, poses: Floats) -> Floats:
        """(k, 2): where the landmarks are most likely, the path being at (n, 3) `poses`."""
        turn = rotation_matrices(poses[self.place, 2])
        seen = poses[self.place, :2] + np.einsum("mab,mb->ma", turn, self.where_m)
        information = turn @ self.information @ turn.transpose(0, 2, 1)
        count = len(self.labels)
        found = np.array(
            [np.median(seen[self.landmark == k], axis=0) for k in range(count)]
        ).reshape(-1, 2)
        for _ in range(ROUNDS):
            weighed = information * self.weights(poses, found)[:, None, None]
            whole = np.zeros((count, 2, 2))
            pull = np.zeros((count, 2))
            np.add.at(whole, self.landmark, weighed)
            np.add.at(pull, self.landmark, np.einsum("mab,mb->ma", weighed, seen))
            found = np.linalg.solve(whole, pull[..., None])[..., 0]
        return found

    def constraints(self, first_landmark: int, weights: Floats) -> Constraints:
        """Between places of the path and landmarks, the latter as poses from number
        `first_landmark` on.
        """
        measured = np.column_stack([self.where_m, np.zeros(len(self.place))])
        information = np.zeros((len(self.place), 3, 3))
        information[:, :2, :2] = self.information * weights[:, None, None]
        information[:, 2, 2] = NO_HEADING
        return Constraints(self.place, first_landmark + self.landmark, measured, information)

    def joined(self, graph: PoseGraph, landmarks_m: Floats) -> PoseGraph:
        """`graph` with the landmarks as poses behind those of the path, bound to it by what was
        seen.
        """
        poses = np.vstack([graph.poses, np.column_stack([landmarks_m, np.zeros(len(landmarks_m))])])
        seen = self.constraints(len(graph.poses), self.weights(graph.poses, landmarks_m))
        return PoseGraph(poses, graph.steps, graph.closures + seen)
