"""Runs with cameras: what other runs are told as percepts is drawn here, and seen by sensory memory
and EPAM.
"""

from __future__ import annotations

import copy
import gc
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from cogmap.errors import CogmapError
from cogmap.parallel import Progress
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message
from schemas.sensing import MotorCommand, TruePose
from services import registry
from services.sim.layout.catalogue import CATALOGUE

# Of the time that all runs take.
DRAWN_SHARE = 0.9
SENSES = ("sensory", "epam")
_SENSED = (topics.SELF_MOTION, topics.SCAN, topics.PERCEPTS)
Result = TypeVar("Result")


def with_cameras(sections: Sections) -> Sections:
    """The configuration of a led robot that senses by cameras, from that of one that is told
    percepts.

    Its landmarks, in their order, become the buildings of the catalogue. Raises CogmapError where
    they are more.
    """
    changed: dict[str, Any] = copy.deepcopy(dict(sections))
    sim = changed["sim"]
    sim.pop("percepts", None)
    sim["trajectory"] = {
        **sim["trajectory"],
        "sensing": "cameras",
        "landmarks": named(sim["trajectory"]["landmarks"]),
    }
    sim["awaits"] = {**sim["awaits"], **dict.fromkeys(SENSES, 1)}
    noise = sim["noise"]
    changed["sensory"] = {
        "speed_noise": noise["speed"],
        "turn_noise": noise["turn"],
        "drift_rad_per_sqrt_m": noise["drift_rad_per_sqrt_m"],
    }
    return changed


def named(landmarks: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """`landmarks` by names of the catalogue. Raises CogmapError where it has too few."""
    if len(landmarks) > len(CATALOGUE):
        raise CogmapError(
            f"cameras know {len(CATALOGUE)} kinds of building apart, too few for {len(landmarks)}"
        )
    return [
        {"name": kind.name, "x_m": each["x_m"], "y_m": each["y_m"]}
        for kind, each in zip(CATALOGUE, landmarks, strict=False)
    ]


class SensorLog:
    """What was sensed in a run, frame by frame, to be given to other minds: a led robot senses
    whatever they think.
    """

    def __init__(self, progress: Progress = lambda share: None) -> None:
        self._frames: dict[int, list[Message]] = {}
        self._progress = progress

    def recorder(self) -> Module:
        """The module that listens in the first run."""
        module = Module("sensor_log").on(topics.TRUE_POSE, self._keep_pose)
        for topic in _SENSED:
            module.on(topic, self._keep)
        return module

    def player(self) -> Module:
        """The module that says it all again, in the place of the senses."""
        frames = iter([self._frames[stamp_ns] for stamp_ns in sorted(self._frames)])

        def answer(command: MotorCommand) -> list[Message]:
            return next(frames, [])

        says = (topics.TRUE_POSE, *_SENSED)
        module = Module("sim").on(topics.MOTOR_COMMAND, answer, says)
        return module.on_start(lambda: next(frames), {"action": 1}, says)

    def _keep(self, message: Message) -> None:
        self._frames.setdefault(message.stamp_ns, []).append(message)

    def _keep_pose(self, told: TruePose) -> None:
        self._keep(told)
        self._progress(told.progress)


def by_cameras(
    configured: Mapping[str, Sections],
    mind: Sequence[str],
    drive: Callable[[Sections, Sequence[Module]], Result],
    progress: Progress = lambda share: None,
) -> dict[str, Result]:
    """What `drive` gives for each of `configured`, which differ in their minds alone.

    `drive` is given a configuration and the modules to run. The first run has everything; what was
    sensed in it is given to the other minds, so that nothing is drawn or recognised twice.
    """
    sensor_log = SensorLog(lambda share: progress(DRAWN_SHARE * share))
    results = dict[str, Result]()
    for name, sections in configured.items():
        seeing = with_cameras(sections)
        minds = [registry.build(module, seeing) for module in mind]
        if results:
            senses = [sensor_log.player()]
        else:
            senses = [
                *(registry.build(module, seeing) for module in ("sim", *SENSES)),
                sensor_log.recorder(),
            ]
        results[name] = drive(seeing, [*senses, *minds])
        # A process has one renderer at a time, which goes with its module: now, not whenever that
        # is found unused.
        del senses
        gc.collect()
    progress(1.0)
    return results
