"""The names of buildings whose neighbours were just conscious: two laps of held-out towns, each
view in another light, seen by two extended PAMs, one of which expects nothing.

Clear views of these towns are hardly ever ambiguous, so there is fog in the second lap.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.perception import sequence
from benchmarks.perception.objects import claims, sight
from benchmarks.perception.pipeline import SensoryPipeline
from benchmarks.perception.scenes import FIRST_SEED, Scene, drawn, side_and_range
from benchmarks.report import Metrics
from cogmap.cli.progress import bar
from cogmap.geometry.arrays import Bytes
from cogmap.parallel import parallel_map
from cogmap.runtime.module import Module
from cogmap.schemas.cognition import Broadcast, Coalition, Relation, Trigger
from cogmap.schemas.nodes import Object, object_id
from cogmap.schemas.sensing import Percept, Percepts, Pose, View
from cogmap.services import registry
from cogmap.services.epam.public import function_of
from cogmap.services.sim.public import CATALOGUE, town

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
PERIOD_S = 0.4
SURE = 0.7
"""With less evidence for its name a view is ambiguous. LIDA: the threshold of percepts."""
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
    """Measure the gain by priming on ambiguous views, and on all."""
    with bar("naming buildings") as progress:
        towns = parallel_map(namings_in, list(SEEDS), processes, progress)

    found = [naming for namings in towns for naming in namings]
    ambiguous = [naming for naming in found if not naming.is_sure]
    return {
        "priming_gain": _gain(ambiguous),
        "priming_gain_all": _gain(found),
        "unprimed_top1_ambiguous": _share([naming.right for naming in ambiguous]),
        "ambiguous_views": float(len(ambiguous)),
        "named_views": float(len(found)),
    }


def namings_in(seed: int) -> list[Naming]:
    """Return the buildings of trained kinds that are seen in the last lap of a town.

    Two extended PAMs get its views. One of them also gets broadcasts of what was sure in the view
    before, as attention to what is in view brings it.
    """
    bare = registry.build("epam", {"epam": {"priming": {"share": 0.0}}})
    primed = registry.build("epam", {})
    found: list[Naming] = []

    with drawn(seed, 0, _laps) as (place, camera, scenes):
        sensory = SensoryPipeline(camera, PERIOD_S)
        every = list(scenes)
        rng = np.random.default_rng([seed, 0xF0])

        for number, clear in enumerate(every):
            is_last_lap = number >= len(every) // LAPS
            scene = in_fog(clear, rng) if is_last_lap else clear
            view = sensory.view(sensory.next_frame(scene.left, scene.right))
            without = _percepts(bare, view)
            with_priming = _percepts(primed, view)

            conscious = [percept for percept in without if percept.evidence > SURE]
            if conscious:
                primed.feed(_broadcast(view, conscious))
            if is_last_lap:
                found += _compared(scene, place, without, with_priming)

    return found


def _percepts(epam: Module, view: View) -> list[Percept]:
    return next(each for each in epam.feed(view) if isinstance(each, Percepts)).objects


def _laps(place: town.Town, rng: np.random.Generator) -> list[Pose]:
    poses: list[Pose] = []
    for _ in range(LAPS):
        poses += sequence.poses(place.line(), rng, STEPS_M, OFFSET_M, TURN_RAD)
    return poses


def in_fog(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return the scene in fog, which hides a share of 1 - exp(-depth / FOG_REACH_M) (Koschmieder's
    law), with noise of the sensor. The depth of the left image serves for both.
    """
    depth_m = np.where(scene.depth_m > 0, scene.depth_m, np.inf)
    clear = np.exp(-depth_m / FOG_REACH_M)[..., None]

    def foggy(image: Bytes) -> Bytes:
        blended = image * clear + FOG_GREY * (1 - clear)
        noisy = blended + rng.normal(0.0, NOISE_SD, image.shape)
        return np.asarray(noisy.clip(0, 255), np.uint8)

    return replace(scene, left=foggy(scene.left), right=foggy(scene.right))


def _broadcast(view: View, conscious: Sequence[Percept]) -> Broadcast:
    nodes = []
    relations = {}
    for percept in conscious:
        label = percept.name
        name = object_id(label)
        names = {label: 1.0}
        nodes.append(
            Object(id=name, label=label, names=names, x_m=0.0, y_m=0.0, function=function_of(label))
        )
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


def _compared(
    scene: Scene,
    place: town.Town,
    bare: Sequence[Percept],
    primed: Sequence[Percept],
) -> Iterator[Naming]:
    """Yield the buildings that the extended PAM without priming has a percept of."""
    kinds = [plot.kind.name for plot in place.plots]
    range_m = side_and_range(place, scene.pose)[:, 1].tolist()
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
