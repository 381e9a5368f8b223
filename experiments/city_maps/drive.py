"""One traversal: the modules that drive the town, on the in-memory bus, led along a tour; what they
then believe.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from cogmap.errors import CogmapError
from cogmap.geometry.se2 import rotation_matrices
from cogmap.graph.graph import TILE_SIDE, Graph, object_id
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from experiments import in_memory
from experiments.city_maps.correction import settings
from experiments.city_maps.environment import Environment
from experiments.city_maps.streets import Points
from schemas import topics
from schemas.graph import Delta, Node
from schemas.sensing import TruePose
from services import registry
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import ODOMETRY, POSE, STAMP, rows_of
from services.sim.odometry import Noise

MIND = ("workspace", "codelets", "global_workspace", "action")
SENSING = "percept-level sensing"
SPEED_M_S = 5.0
FRAME_HZ = 1
LEAD_M = 70.0
OVERRUN_M = 100.0
CELL_M = 5.0
# Who walks through a city looks about: to the sides too, where a camera that is fixed looks ahead
# alone.
LOOKING_ABOUT_RAD = math.pi


@dataclass(frozen=True, eq=False)
class Traversal:
    """What one agent made of one tour, in the true frame: (n, 3) poses believed and true, view by
    view.

    `path_m` (n, 2) is the way as the map has it in the end, `buildings_m` (8, 2) has NaN for one
    that is not on the map, and `road_m` (k, 2) are the places that are road. `felt_m` (8, 2) is
    where the buildings were seen from the way that path integration alone would have had.
    """

    believed: Points
    true: Points
    path_m: Points
    buildings_m: Points
    road_m: Points
    felt_m: Points


class _Watcher:
    """An observer: the graph, and the truth."""

    def __init__(self) -> None:
        self.graph = Graph(CELL_M)
        self.believed: list[tuple[float, float, float]] = []
        self.true: list[tuple[float, float, float]] = []

    def on_delta(self, delta: Delta) -> None:
        if not self.graph.apply(delta):
            raise CogmapError(f"delta {delta.version} came out of turn")
        if delta.phase == "localization":
            facts = self.graph.nodes["self"].attributes
            self.believed.append(tuple(float(facts[key]) for key in ("x_m", "y_m", "heading_rad")))  # type: ignore[arg-type]

    def on_pose(self, told: TruePose) -> None:
        self.true.append((told.pose.x_m, told.pose.y_m, told.pose.heading_rad))

    def module(self) -> Module:
        """Itself, as a module that only listens."""
        return Module("observer").on(topics.DELTA, self.on_delta).on(topics.TRUE_POSE, self.on_pose)


@dataclass(frozen=True)
class Tour:
    """One way through an environment: from which building, in which direction; the seed of all its
    noise.
    """

    start: int
    backward: bool
    seed: int


def sections(environment: Environment, tour: Tour, noise: Noise, method: str) -> Sections:
    """The configuration of every module for one traversal, as for `cogmap run --config`."""
    line = environment.line(tour.start, tour.backward, LEAD_M, OVERRUN_M)
    landmarks = [
        {"name": name, "x_m": float(x), "y_m": float(y)}
        for name, (x, y) in zip(environment.names, environment.buildings_m, strict=True)
    ]
    way = {"line_m": line.tolist(), "landmarks": landmarks, "speed_m_s": SPEED_M_S}
    senses = {
        "noise": msgspec.structs.asdict(noise),
        "percepts": {"field_of_view_rad": LOOKING_ABOUT_RAD},
    }
    rates = {"frame_hz": FRAME_HZ, "odometry_hz": FRAME_HZ, "awaits": dict.fromkeys(MIND, 1)}
    correction = settings(method, SPEED_M_S / FRAME_HZ)
    return {
        "sim": {"mode": "lockstep", "seed": tour.seed, "trajectory": way, **senses, **rates},
        "workspace": {
            "mode": "lockstep",
            "cell_m": CELL_M,
            "base_level_decay": 0.0,
            **correction["workspace"],
        },
        "codelets": correction["codelets"],
        "action": {"mode": "lockstep"},
    }


def traverse(configured: Sections) -> Traversal:
    """Drive one tour to its end. Raises CogmapError where a message was lost or refused."""
    return driven(configured, [registry.build(name, configured) for name in ("sim", *MIND)])


def driven(configured: Sections, modules: Sequence[Module]) -> Traversal:
    """As `traverse`, with these modules."""
    watcher = _Watcher()
    in_memory.run([*modules, watcher.module()])
    (x, y), (ahead_x, ahead_y) = configured["sim"]["trajectory"]["line_m"][:2]
    names = tuple(each["name"] for each in configured["sim"]["trajectory"]["landmarks"])
    origin = np.array([x, y, np.arctan2(ahead_y - y, ahead_x - x)])
    return Traversal(
        believed=_placed(np.array(watcher.believed), origin),
        true=np.array(watcher.true)[: len(watcher.believed)],
        path_m=_placed(rows_of(watcher.graph.nodes.values())[:, POSE], origin)[:, :2],
        buildings_m=_buildings(watcher.graph, names, origin),
        road_m=_roads(watcher.graph, origin),
        felt_m=_felt(watcher.graph, names, origin),
    )


def _placed(own: Points, origin: Points) -> Points:
    """Positions or poses in the agent's own frame, (n, 2) or (n, 3), in the frame where that begins
    at `origin`.
    """
    cos = np.cos(origin[2])
    sin = np.sin(origin[2])
    placed = np.array(own, float)
    placed[:, :2] = own[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + origin[:2]
    if own.shape[1] == 3:
        placed[:, 2] += origin[2]
    return placed


def _buildings(graph: Graph, names: tuple[str, ...], origin: Points) -> Points:
    nodes: list[Node | None] = [graph.nodes.get(object_id(name)) for name in names]
    own = [
        (np.nan, np.nan)
        if node is None
        else (float(node.attributes["x_m"]), float(node.attributes["y_m"]))
        for node in nodes
    ]
    return _placed(np.array(own), origin)


def _felt(graph: Graph, names: tuple[str, ...], origin: Points) -> Points:
    """The median of all sightings of each building, by path integration from the beginning."""
    rows = rows_of(graph.nodes.values())
    seen = Sightings.of(graph.nodes.values(), rows[:, STAMP])
    poses = rows[:, ODOMETRY] - np.append(rows[0, ODOMETRY][:2] - rows[0, POSE][:2], 0.0)
    stood = poses[seen.place]
    where = stood[:, :2] + np.einsum("mab,mb->ma", rotation_matrices(stood[:, 2]), seen.where_m)
    number = {label: index for index, label in enumerate(seen.labels)}
    own = [
        np.median(where[seen.landmark == number[name]], axis=0)
        if name in number
        else (np.nan, np.nan)
        for name in names
    ]
    return _placed(np.array(own), origin)


def _roads(graph: Graph, origin: Points) -> Points:
    cells = [
        np.argwhere(graph.tiles[key].columns["road"] > 0) + np.array(key) * TILE_SIDE
        for key in sorted(graph.tiles)
    ]
    where = np.vstack(cells) if cells else np.zeros((0, 2))
    return _placed(where * graph.cell_m, origin)
