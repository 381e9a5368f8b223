"""The wanderer in one Python process with the simulator: `python -m examples.in_process`."""

from __future__ import annotations

from cogmap.bus.codec import decode
from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus
from cogmap.runtime.in_process import InProcessRunner
from examples import wanderer
from schemas import topics
from schemas.sensing import TruePose
from services import registry


def drive(frames: int) -> list[TruePose]:
    """The robot's true poses while the wanderer answers that many frames, in lockstep."""
    sections = {"sim": {"mode": "lockstep", "egl": False}}
    modules = [registry.build(name, sections) for name in ("sim", "sensory")]
    modules.append(wanderer.build(wanderer.Config()))
    runner = InProcessRunner(modules)

    poses: list[TruePose] = []

    def on_pose(arrival: Arrival) -> None:
        pose = decode(arrival.topic, arrival.payload)
        assert isinstance(pose, TruePose)
        poses.append(pose)

    observer = MemoryBus(runner.network)
    observer.subscribe(topics.TRUE_POSE, on_pose, lambda name, number: None)
    runner.run(lambda: len(poses) >= frames)
    runner.close()
    return poses


if __name__ == "__main__":
    print(f"{drive(20)[-1].travelled_m:.1f} m driven")
