"""Whether a building is named better when its neighbours were just conscious: two laps of held-out
towns, each view in another light, seen by two extended PAMs, one of which expects nothing.

Clear views of these towns are hardly ever ambiguous, so there is fog in the second lap.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.perception import sequence
from benchmarks.perception.objects import claims, sight
from benchmarks.perception.scenes import FIRST_SEED, Scene, drawn
from benchmarks.report import Metrics
from cogmap.geometry.arrays import Bytes
from cogmap.parallel import parallel_map
from cogmap.runtime.module import Module
from cogmap.schemas.array import Array
from cogmap.schemas.cognition import Broadcast, Coalition, Relation, Trigger
from cogmap.schemas.nodes import Object, object_id
from cogmap.schemas.sensing import Calibration, Odometry, Percept, Percepts, Pose, StereoFrame, View
from cogmap.services import registry
from cogmap.services.epam.recognition.functions import function_of
from cogmap.services.sim.layout import town
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.workspace.ingress import RECOGNITION_THRESHOLD

TOWNS = 4
# After the towns of `python -m benchmarks perception`.
SEEDS = range(FIRST_SEED + 200, FIRST_SEED + 200 + TOWNS)
LAPS = 2
STEPS_M = (1.6, 2.4)
OFFSET_M = 0.5
TURN_RAD = 0.05
FOG_REACH_M = 40.0
FOG_GREY = 190.0
NOISE_SD = 4.0
PERIOD_NS = 400_000_000
SURE = RECOGNITION_THRESHOLD
"""With less evidence a view is ambiguous, and is not mapped by."""
TRAINED = frozenset(kind.name for kind in CATALOGUE)


@dataclass(frozen=True)
class Naming:
    """A building seen in the last lap: whether the view by itself was sure of what it is, and
    whether it was named rightly without priming and with it.
    """

    is_sure: bool
    right: bool
    right_primed: bool


def measure(processes: int) -> Metrics:
    """The gain by priming on ambiguous views, and on all."""
    found: list[Naming] = []
    for namings in parallel_map(namings_in, list(SEEDS), processes):
        found += namings

    ambiguous = [naming for naming in found if not naming.is_sure]
    return {
        "priming_gain": _gain(ambiguous),
        "priming_gain_all": _gain(found),
        "unprimed_top1_ambiguous": _share([naming.right for naming in ambiguous]),
        "ambiguous_views": float(len(ambiguous)),
        "named_views": float(len(found)),
    }


def namings_in(seed: int) -> list[Naming]:
    """The buildings of trained kinds that are seen in the last lap of a town."""
    found: list[Naming] = []
    with drawn(seed, 0, _laps) as (place, camera, scenes):
        pair = _Pair(camera)
        kinds = [plot.kind.name for plot in place.plots]
        numbered = list(enumerate(scenes))
        first_judged = len(numbered) // LAPS
        rng = np.random.default_rng([seed, 0xF0])
        for number, scene in numbered:
            if number < first_judged:
                pair.see(scene)
                continue
            bare, primed = pair.see(_in_fog(scene, rng))
            found += _compared(scene, kinds, place, bare, primed)

    return found


def _in_fog(scene: Scene, rng: np.random.Generator) -> Scene:
    """The scene in fog, of which a share of 1 - exp(-depth / FOG_REACH_M) is seen (Koschmieder's
    law), with noise of the sensor. The depth of the left image serves for both.
    """
    depth_m = np.where(scene.depth_m > 0, scene.depth_m, np.inf)
    clear = np.exp(-depth_m / FOG_REACH_M)[..., None]

    def foggy(image: Bytes) -> Bytes:
        blended = image * clear + FOG_GREY * (1 - clear)
        noisy = blended + rng.normal(0.0, NOISE_SD, image.shape)
        return np.asarray(noisy.clip(0, 255), np.uint8)

    return replace(scene, left=foggy(scene.left), right=foggy(scene.right))


class _Pair:
    """Sensory memory, and two extended PAMs that get its views and the same broadcasts: of what was
    sure in the view before, as attention to what is in view brings it.
    """

    def __init__(self, camera: Calibration) -> None:
        self._camera = camera
        self._sensory = registry.build("sensory", {})
        self._bare = registry.build("epam", {"epam": {"priming": {"share": 0.0}}})
        self._primed = registry.build("epam", {})
        self._frame = 0

    def see(self, scene: Scene) -> tuple[list[Percept], list[Percept]]:
        """The percepts of a view, without priming and with it."""
        view = self._view(scene)
        bare = _percepts(self._bare, view)
        primed = _percepts(self._primed, view)

        conscious = [percept for percept in bare if percept.evidence > SURE]
        if conscious:
            self._primed.feed(_broadcast(view, conscious))
        return bare, primed

    def _view(self, scene: Scene) -> View:
        self._frame += 1
        stamp_ns = self._frame * PERIOD_NS
        frame = StereoFrame(
            stamp_ns=stamp_ns,
            frame=self._frame,
            left=Array.of(scene.left),
            right=Array.of(scene.right),
            calibration=self._camera,
        )
        still = Odometry(stamp_ns=stamp_ns, speed_m_s=0.0, turn_rate_rad_s=0.0, dt_s=0.4)
        self._sensory.feed(still)
        return next(each for each in self._sensory.feed(frame) if isinstance(each, View))


def _percepts(epam: Module, view: View) -> list[Percept]:
    found = next(each for each in epam.feed(view) if isinstance(each, Percepts))
    return found.objects


def _broadcast(view: View, conscious: Sequence[Percept]) -> Broadcast:
    nodes = []
    relations = {}
    for percept in conscious:
        label = percept.label
        name = object_id(label)
        nodes.append(Object(id=name, label=label, x_m=0.0, y_m=0.0, function=function_of(label)))
        relations[name] = Relation(
            look=label, range_m=percept.range_m, bearing_rad=percept.bearing_rad
        )

    return Broadcast(
        stamp_ns=view.stamp_ns,
        cycle=view.frame,
        trigger=Trigger.ONE_COALITION,
        coalition=Coalition(
            codelet="whereabouts", activation=0.5, nodes=list(nodes), relations=relations
        ),
    )


def _laps(place: town.Town, rng: np.random.Generator) -> list[Pose]:
    poses: list[Pose] = []
    for _ in range(LAPS):
        poses += sequence.poses(place.line(), rng, STEPS_M, OFFSET_M, TURN_RAD)
    return poses


def _compared(
    scene: Scene,
    kinds: Sequence[str],
    place: town.Town,
    bare: Sequence[Percept],
    primed: Sequence[Percept],
) -> Iterator[Naming]:
    """The buildings that the extended PAM without priming has a percept of."""
    here = np.array([scene.pose.x_m, scene.pose.y_m])
    range_m = [float(np.hypot(*(here - (plot.x_m, plot.y_m)))) for plot in place.plots]
    without = sight(claims(bare, scene.label.shape), scene.label, kinds, range_m)
    with_it = sight(claims(primed, scene.label.shape), scene.label, kinds, range_m)

    names_primed = {}
    for segment in with_it.segments:
        if segment.building is not None:
            names_primed[segment.building.number] = segment.label

    for percept, segment in zip(bare, without.segments, strict=True):
        building = segment.building
        if building is None or building.kind not in TRAINED:
            continue
        yield Naming(
            is_sure=percept.evidence > SURE,
            right=segment.label == building.kind,
            right_primed=names_primed.get(building.number) == building.kind,
        )


def _gain(namings: Sequence[Naming]) -> float:
    primed = _share([naming.right_primed for naming in namings])
    return primed - _share([naming.right for naming in namings])


def _share(right: Sequence[bool]) -> float:
    return float(np.mean(right)) if right else float("nan")
