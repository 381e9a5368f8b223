"""Runs with cameras: percepts come from images that are drawn, by sensory memory and EPAM."""

from __future__ import annotations

import copy
import gc
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from cogmap.errors import CogmapError
from cogmap.parallel import Progress
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import MotorCommand, TruePose
from cogmap.services import registry
from cogmap.services.sim.layout.catalogue import CATALOGUE

# Of the time that all runs take.
DRAWN_SHARE = 0.9
SENSES = ("sensory", "epam")
_SENSED = (topics.SELF_MOTION, topics.SCAN, topics.PERCEPTS)
_REPLAYED = (topics.TRUE_POSE, *_SENSED)
Result = TypeVar("Result")


def with_cameras(sections: Sections) -> Sections:
    """Return the configuration of a scripted robot with cameras, from that of one without.

    Its landmarks, in their order, become the buildings of the catalogue. Raises CogmapError if
    they are more.
    """
    changed: dict[str, Any] = copy.deepcopy(dict(sections))
    sim = changed["sim"]
    sim.pop("percepts", None)
    sim["trajectory"]["sensing"] = "cameras"
    sim["trajectory"]["landmarks"] = named(sim["trajectory"]["landmarks"])
    changed["run"]["participants"] |= dict.fromkeys(SENSES, 1)

    noise = sim["noise"]
    changed["sensory"] = {
        "speed_noise": noise["speed"],
        "turn_noise": noise["turn"],
        "drift_rad_per_sqrt_m": noise["drift_rad_per_sqrt_m"],
    }
    return changed


def named(landmarks: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return `landmarks` by names of the catalogue. Raises CogmapError if it has too few."""
    if len(landmarks) > len(CATALOGUE):
        raise CogmapError(
            f"cameras tell {len(CATALOGUE)} kinds of building apart, too few for {len(landmarks)}"
        )

    found = []
    for kind, landmark in zip(CATALOGUE, landmarks, strict=False):
        found.append({"name": kind.name, "x_m": landmark["x_m"], "y_m": landmark["y_m"]})

    return found


class SensorLog:
    """What was sensed in a run, frame by frame, to be replayed to modules configured otherwise.

    A scripted robot senses the same whatever is made of it.
    """

    def __init__(self, progress: Progress = lambda share: None) -> None:
        self._frames: dict[int, list[Message]] = {}
        self._progress = progress

    def recorder(self) -> Module:
        """Return the module that records the first run."""
        module = Module("sensor_log").on(topics.TRUE_POSE, self._keep_pose)

        for topic in _SENSED:
            module.on(topic, self._keep)

        return module

    def player(self) -> Module:
        """Return the module that publishes it all again, in the place of the senses."""
        in_order = [self._frames[stamp_ns] for stamp_ns in sorted(self._frames)]
        frames = iter(in_order)

        def on_start() -> list[Message]:
            return next(frames)

        def on_command(command: MotorCommand) -> list[Message]:
            return next(frames, [])

        module = Module("sim")
        module.on_start(on_start, {"motor": 1}, _REPLAYED)
        module.on(topics.MOTOR_COMMAND, on_command, _REPLAYED)
        return module

    def _keep(self, message: Message) -> None:
        frame = self._frames.setdefault(message.stamp_ns, [])
        frame.append(message)

    def _keep_pose(self, true: TruePose) -> None:
        self._keep(true)
        self._progress(true.progress)


def by_cameras(
    configured: Mapping[str, Sections],
    cognition: Sequence[str],
    drive: Callable[[Sections, Sequence[Module]], Result],
    progress: Progress = lambda share: None,
) -> dict[str, Result]:
    """Return what `drive` gives for each of `configured`, which differ in their `cognition` alone.

    `drive` is given a configuration and the modules to run. The first run has everything; what was
    sensed in it is replayed in the others, so that nothing is drawn or recognised twice.
    """
    sensor_log = SensorLog(lambda share: progress(DRAWN_SHARE * share))
    results = dict[str, Result]()

    for name, sections in configured.items():
        rendered = with_cameras(sections)
        if results:
            modules = [sensor_log.player()]
        else:
            modules = [registry.build(module, rendered) for module in ("sim", *SENSES)]
            modules.append(sensor_log.recorder())
        modules += [registry.build(module, rendered) for module in cognition]
        results[name] = drive(rendered, modules)

        # A process has one renderer at a time, which goes with its module: now, not whenever that
        # is found unused.
        del modules
        gc.collect()

    progress(1.0)
    return results
