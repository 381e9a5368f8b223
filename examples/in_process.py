"""The wanderer in one Python process with the simulator: `python -m examples.in_process`."""

from __future__ import annotations

from cogmap import InProcessRunner, topics
from examples import wanderer
from schemas.sensing import TruePose
from services import registry


def drive(frames: int) -> list[TruePose]:
    """The robot's true poses while the wanderer answers that many frames, in lockstep."""
    sections = {"sim": {"mode": "lockstep", "egl": False}}
    modules = [registry.build(name, sections) for name in ("sim", "sensory")]
    modules.append(wanderer.build(wanderer.Config()))

    poses: list[TruePose] = []
    with InProcessRunner(modules) as runner:
        runner.observe(topics.TRUE_POSE, poses.append)
        runner.run(until=lambda: len(poses) >= frames)
    return poses


if __name__ == "__main__":
    print(f"{drive(20)[-1].travelled_m:.1f} m driven")
