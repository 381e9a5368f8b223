"""One loop, driven by the modules of the town on the in-memory bus, and what its corrections made
of the map.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.errors import CogmapError
from cogmap.graph.graph import TILE_SIDE, Graph
from cogmap.parallel import Progress
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from experiments import in_memory, rendered
from experiments.loop_closing.rule import close_laps
from schemas import topics
from schemas.cognition import Replay
from schemas.graph import Delta
from schemas.sensing import TruePose
from services import registry
from services.codelets.mapping.path import POSE, STAMP, rows_of
from services.sim.config import Config
from services.sim.odometry import Noise

Floats = npt.NDArray[np.float64]
MIND = ("workspace", "codelets", "global_workspace", "action")
SENSING = "percept-level sensing"
METHODS = ("positions", "heading")
CORNERS_M = (
    (0.0, 0.0),
    (180.0, 0.0),
    (180.0, 70.0),
    (260.0, 70.0),
    (260.0, 220.0),
    (0.0, 220.0),
    (0.0, 0.0),
)
AGAIN_M = (120.0, 0.0)
ASIDE_M = 14.0
APART_M = 60.0
CORNER_RAD = np.pi / 2
LAPS = 1000
SPEED_M_S = 5.0
FRAME_HZ = 2
CELL_M = 3.0
# The wheels of the town's robot, read ten times between two views: each reading's factors err anew,
# drift adds up.
READINGS = Config().odometry_hz // FRAME_HZ
NOISE = Noise(speed=Noise().speed / READINGS**0.5, turn=Noise().turn / READINGS**0.5)


@dataclass(frozen=True)
class Map:
    """What the agent believes at one time, in its own frame, which begins as the true one does.

    (n, 2) `path_m` and where it truly was then, (k, 2) objects and where they truly stand, and
    `road_m`.
    """

    path_m: Floats
    true_path_m: Floats
    objects_m: Floats
    true_objects_m: Floats
    road_m: Floats

    @property
    def path_error_m(self) -> float:
        """Root mean square over the path."""
        return _rms(self.path_m - self.true_path_m)

    @property
    def object_error_m(self) -> float:
        """Root mean square over the objects."""
        return _rms(self.objects_m - self.true_objects_m)

    @property
    def end_error_m(self) -> float:
        """Where the agent takes itself to be, from where it is."""
        return float(np.hypot(*(self.path_m[-1] - self.true_path_m[-1])))


@dataclass(frozen=True)
class Replayed:
    """What a replay told: `shifts_m` (n,) of the place fields in its order, and how synapses
    change.

    `nearer_m` (m,) is by how much the fields of each pair of place cells come nearer. `close` tells
    the pairs near enough, before and after, for exp(-k d) to be about linear: less than 1/k apart.
    """

    passes: int
    decay_per_m: float
    shifts_m: Floats
    nearer_m: Floats
    strength_changes: Floats
    close: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, told: Replay) -> Replayed:
        """From the event on the bus."""
        positions = np.asarray(told.positions_m.numpy(), float)
        shifts = np.asarray(told.shifts_m.numpy(), float)
        pairs = np.asarray(told.pairs.numpy(), np.int64)
        apart = [
            np.hypot(*(where[pairs[:, 0]] - where[pairs[:, 1]]).T)
            for where in (positions, positions + shifts)
        ]
        changes = np.asarray(told.strength_changes.numpy(), float)
        close = np.maximum(*apart) * told.decay_per_m < 1
        return cls(
            told.replays, told.decay_per_m, np.hypot(*shifts.T), apart[0] - apart[1], changes, close
        )


@dataclass(frozen=True)
class Loop:
    """The map before the first correction was carried out, right after it, and in the end; and all
    replays.
    """

    before: Map
    after: Map
    end: Map
    replays: list[Replayed]


@dataclass
class _Observer:
    """The graph, the truth and the replays; a map before and after the first correction."""

    landmarks: dict[str, tuple[float, float]]
    graph: Graph = field(default_factory=lambda: Graph(CELL_M))
    true: dict[int, tuple[float, float]] = field(default_factory=dict)
    replays: list[Replayed] = field(default_factory=list)
    before: Map | None = None
    after: Map | None = None

    def on_delta(self, delta: Delta) -> None:
        shift = delta.phase == "shift" and self.before is None
        self.before = self.map() if shift else self.before
        if not self.graph.apply(delta):
            raise CogmapError(f"delta {delta.version} came out of turn")
        self.after = self.map() if shift else self.after

    def on_pose(self, told: TruePose) -> None:
        self.true[told.stamp_ns] = (told.pose.x_m, told.pose.y_m)

    def on_replay(self, told: Replay) -> None:
        self.replays.append(Replayed.of(told))

    def map(self) -> Map:
        """The map as it is now."""
        rows = rows_of(self.graph.nodes.values())
        stamps = np.rint(rows[:, STAMP] * 1e9).astype(np.int64).tolist()
        objects = [node for _, node in sorted(self.graph.nodes.items()) if node.kind == "object"]
        known = [node for node in objects if node.attributes["label"] in self.landmarks]
        cells = [
            np.argwhere(tile.columns["road"] > 0) + TILE_SIDE * np.array(at)
            for at, tile in self.graph.tiles.items()
        ]
        return Map(
            path_m=rows[:, POSE][:, :2],
            true_path_m=np.array([self._true(stamp) for stamp in stamps]),
            objects_m=np.array(
                [(node.attributes["x_m"], node.attributes["y_m"]) for node in known], float
            ),
            true_objects_m=np.array(
                [self.landmarks[str(node.attributes["label"])] for node in known]
            ),
            road_m=np.vstack([np.zeros((0, 2)), *cells]) * CELL_M,
        )

    def _true(self, stamp_ns: int) -> tuple[float, float]:
        nearest = min(self.true, key=lambda known_ns: abs(known_ns - stamp_ns))
        return self.true[nearest]


def way() -> dict[str, Any]:
    """A line round some blocks and a bit of it again, and landmarks beside it."""
    corners = np.array(CORNERS_M)
    landmarks = []
    number = 0
    for start, end in itertools.pairwise(corners):
        length = float(np.hypot(*(end - start)))
        along = (end - start) / length
        beside = np.array([along[1], -along[0]])
        for way_m in np.arange(APART_M / 2, length, APART_M):
            x_m, y_m = (
                start + way_m * along + beside * ASIDE_M * (1 if number % 2 else -1)
            ).tolist()
            landmarks.append({"name": f"building-{number:02d}", "x_m": x_m, "y_m": y_m})
            number += 1
    return {"line_m": [*CORNERS_M, AGAIN_M], "landmarks": landmarks, "speed_m_s": SPEED_M_S}


def sections(seed: int, method: str) -> Sections:
    """The configuration of every module, as for `cogmap run --config`."""
    rates = {"frame_hz": FRAME_HZ, "odometry_hz": FRAME_HZ, "awaits": dict.fromkeys(MIND, 1)}
    step_m = SPEED_M_S / FRAME_HZ
    return {
        "sim": {
            "mode": "lockstep",
            "seed": seed,
            "noise": msgspec.structs.asdict(NOISE),
            "trajectory": way(),
            **rates,
        },
        "workspace": {
            "mode": "lockstep",
            "cell_m": CELL_M,
            "base_level_decay": 0.0,
            "path_spacing_m": step_m,
        },
        "codelets": {
            "correct": method,
            "path_spacing_m": step_m,
            "path_variance_per_m": NOISE.speed**2 * step_m,
            "heading_variance_per_m": NOISE.drift_rad_per_sqrt_m**2,
            "heading_variance_per_rad": NOISE.turn**2 * CORNER_RAD,
        },
        "action": {"mode": "lockstep"},
    }


def drive(seed: int, method: str) -> Loop:
    """Drive the loop once. Raises CogmapError where nothing was corrected, or a message was
    refused.
    """
    configured = sections(seed, method)
    return driven(configured, [registry.build(name, configured) for name in ("sim", *MIND)])


def drive_by_cameras(seed: int, progress: Progress) -> dict[str, Loop]:
    """As `drive`, by each of METHODS, with buildings that are drawn and recognised."""
    return rendered.by_cameras(
        {method: sections(seed, method) for method in METHODS}, MIND, driven, progress
    )


def driven(configured: Sections, modules: Sequence[Module]) -> Loop:
    """As `drive`, with these modules."""
    places = {
        item["name"]: (item["x_m"], item["y_m"])
        for item in configured["sim"]["trajectory"]["landmarks"]
    }
    observer = _Observer(places)
    watching = (
        Module("observer")
        .on(topics.DELTA, observer.on_delta)
        .on(topics.TRUE_POSE, observer.on_pose)
    )
    watching.on(topics.REPLAY, observer.on_replay)
    in_memory.run([*modules, watching])
    if observer.before is None or observer.after is None:
        raise CogmapError(f"no loop was closed on the way of seed {configured['sim']['seed']}")
    return Loop(observer.before, observer.after, observer.map(), observer.replays)


def figures(loops: dict[str, Loop]) -> dict[str, float]:
    """What is printed: errors before the first correction and in the end, by method, and what its
    replay predicts.
    """
    said: dict[str, float] = {}
    for method, loop in loops.items():
        for name in ("path", "object", "end"):
            said[f"{name}_error_before_m_{method}"] = getattr(loop.before, f"{name}_error_m")
            said[f"{name}_error_after_m_{method}"] = getattr(loop.after, f"{name}_error_m")
            said[f"{name}_error_in_the_end_m_{method}"] = getattr(loop.end, f"{name}_error_m")
        said[f"corrections_{method}"] = float(len(loop.replays))
        said[f"replays_of_the_first_{method}"] = float(loop.replays[0].passes)
    return said | _predicted(loops["positions"].replays[0])


def _predicted(replay: Replayed) -> dict[str, float]:
    """How the change of synapses goes with how much nearer place fields come: k a metre, where they
    are close.
    """
    said = {"synapse_decay_per_m": replay.decay_per_m}
    for name, pairs in (
        ("close_pairs", replay.close),
        ("all_pairs", np.ones(len(replay.close), bool)),
    ):
        nearer = replay.nearer_m[pairs]
        changes = replay.strength_changes[pairs]
        enough = len(nearer) > 2 and bool(np.ptp(nearer) > 0)
        said[name] = float(len(nearer))
        said[f"strength_change_per_m_{name}"] = (
            float(np.polyfit(nearer, changes, 1)[0]) if enough else 0.0
        )
        said[f"strength_and_shift_correlation_{name}"] = (
            float(np.corrcoef(nearer, changes)[0, 1]) if enough else 0.0
        )
    return said


def figures_of_rule(seed: int) -> dict[str, float]:
    """What eq. 9 does for many laps of path integration alone, with the headings' noise and
    without.
    """
    said = {}
    for name, noise in (
        ("", NOISE),
        ("_exact_headings", Noise(speed=NOISE.speed, turn=0.0, drift_rad_per_sqrt_m=0.0)),
    ):
        laps = close_laps(CORNERS_M, SPEED_M_S / FRAME_HZ, noise, LAPS, seed)
        said[f"rule_over_uncorrected{name}"], said[f"rule_helps_share{name}"] = (
            laps.ratio,
            laps.helped,
        )
    return said


def _rms(off: Floats) -> float:
    return float(np.sqrt(np.square(off).sum(axis=1).mean())) if len(off) else 0.0
