"""What one cycle is about, and the tasks that it gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.graph.graph import Graph
from schemas.array import Array
from schemas.cognition import Task
from schemas.graph import Node
from schemas.sensing import Percept, Percepts
from services.workspace.dispatch import NOBODY

SELF = "self"


@dataclass(frozen=True)
class Scene:
    """What one cycle is about: a view's percepts and the self-motion since the self node was last
    moved.
    """

    cycle: int
    percepts: Percepts
    motions: Array


def task_of(
    scene: Scene, graph: Graph, codelet: str, nodes: list[Node], percepts: list[Percept]
) -> Task:
    """A task for one codelet, of what it reads."""
    subject = f"/{percepts[0].label}" if codelet in {"landmark", "object_place"} else ""
    nothing = Array.of(np.zeros((0, 5)))
    return Task(
        stamp_ns=scene.percepts.stamp_ns,
        task_id=f"{scene.cycle}/{codelet}{subject}",
        codelet=codelet,
        worker=NOBODY,
        attempt=0,
        cycle=scene.cycle,
        base_version=graph.version,
        cell_m=graph.cell_m,
        nodes=nodes,
        percepts=percepts,
        motions=scene.motions if codelet == "localization" else nothing,
        road_m=scene.percepts.road_m
        if codelet == "road_place"
        else Array.of(np.zeros((0, 2), np.float32)),
    )
