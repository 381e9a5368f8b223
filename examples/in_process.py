"""The wanderer in one Python process with the simulator: `python -m examples.in_process`."""

from __future__ import annotations

from cogmap import InProcessRunner, Module, topics
from cogmap.schemas.sensing import TruePose
from cogmap.services import registry
from examples import wanderer


def drive(frames: int) -> list[TruePose]:
    """Return the robot's true poses while the wanderer answers that many frames, in lockstep."""
    poses: list[TruePose] = []
    sections = {"run": {"lockstep": True}, "sim": {"egl": False}}
    runner = InProcessRunner(
        [
            registry.build("sim", sections),
            registry.build("sensory", sections),
            wanderer.build(wanderer.Config()),
            Module("observer").on(topics.TRUE_POSE, poses.append),
        ]
    )
    runner.run(until=lambda: len(poses) >= frames)
    runner.close()
    return poses


if __name__ == "__main__":
    print(f"{drive(20)[-1].travelled_m:.1f} m driven")
