"""Map correction of a whole traversal at once, by the cores of its codelet (paper §5.6, eq. 5-9)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from experiments.city_maps.drive import Traversal
from experiments.city_maps.streets import Points
from services.codelets.least_squares import correct_headings
from services.codelets.path import shifted
from services.codelets.pose_graph import Constraints, PoseGraph
from services.codelets.replay import close_loops

PLACE_SD_M, PLACE_SD_RAD = 2.5, 0.05
LEAST_SD_M, LEAST_SD_RAD = 0.05, 0.002


def corrected(made: Traversal, names: tuple[str, ...], method: str) -> Traversal:
    """`made` with its loops closed by "positions" (eq. 9) or "heading" (beyond the paper).

    A building moves with the place on the path from where it was last seen, a piece of road with the nearest.
    """
    graph = path_graph(made)
    if not len(graph.closures):
        return made
    if method == "positions":
        poses = np.column_stack([close_loops(graph).positions_m, made.believed[:, 2]])
    else:
        poses = correct_headings(graph)
    last = {each.label: percepts.frame for percepts in made.percepts[: len(poses)] for each in percepts.objects}
    seen_from = np.array([last.get(name, 0) for name in names])
    nearest = ((made.road_m[:, None] - made.believed[:, :2]) ** 2).sum(2).argmin(1)
    return replace(
        made,
        believed=poses,
        buildings_m=shifted(made.buildings_m, made.believed[seen_from], poses[seen_from]),
        road_m=shifted(made.road_m, made.believed[nearest], poses[nearest]),
    )


def path_graph(made: Traversal) -> PoseGraph:
    """The path as it was integrated, and the loops that matched places close."""
    steps = [_step(rows) for rows in made.motions[1 : len(made.believed)]]
    measured, information = (np.array(column) for column in zip(*steps, strict=True))
    poses = [made.believed[0]]
    for step in measured:
        x, y, heading = poses[-1]
        cos, sin = np.cos(heading), np.sin(heading)
        poses.append(
            np.array([x + cos * step[0] - sin * step[1], y + sin * step[0] + cos * step[1], heading + step[2]])
        )
    ends = [(match.frame, percepts.frame) for percepts in made.percepts for match in percepts.matches]
    first, second = np.array(ends, np.int64).reshape(-1, 2).T
    along = np.arange(len(steps))
    held = np.diag([PLACE_SD_M**-2, PLACE_SD_M**-2, PLACE_SD_RAD**-2])
    return PoseGraph(
        np.array(poses),
        Constraints(along, along + 1, measured, information),
        Constraints(first, second, np.zeros((len(first), 3)), np.tile(held, (len(first), 1, 1))),
    )


def _step(rows: Points) -> tuple[Points, Points]:
    """What rows of self-motion add up to, and the inverse of its covariance."""
    x = y = heading = 0.0
    covariance = np.diag([LEAST_SD_M**2, LEAST_SD_M**2, LEAST_SD_RAD**2])
    for speed, turn_rate, dt, speed_sd, turn_sd in rows:
        way, turn = speed * dt, turn_rate * dt
        cos, sin = np.cos(heading + turn / 2), np.sin(heading + turn / 2)
        moved = np.eye(3)
        moved[:2, 2] = -sin * way, cos * way
        noise = np.array([[cos, 0.0], [sin, 0.0], [0.0, 1.0]]) * (speed_sd * dt, turn_sd * dt)
        covariance = moved @ covariance @ moved.T + noise @ noise.T
        x, y, heading = x + cos * way, y + sin * way, heading + turn
    return np.array([x, y, heading]), np.linalg.inv(covariance)
