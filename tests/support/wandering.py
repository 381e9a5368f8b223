"""A drive of the wanderer in lockstep, its log committed, which the examples in other languages
replay to the byte.

`python -m tests.support.wandering` records it anew.
"""

from __future__ import annotations

from pathlib import Path

from cogmap.bus.memory import MemoryBus
from cogmap.recording.recorder import Recorder
from cogmap.recording.replaying.outcome import Report
from cogmap.recording.replaying.replay import replay_into
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import MotorCommand
from cogmap.services import registry
from examples import wanderer
from tests.support.includes import ROOT

LOG = ROOT / "examples" / "wanderer.mcap"
FRAMES = 60
SETTINGS = wanderer.Config()
_SECTIONS: Sections = {
    "run": {"lockstep": True},
    "sim": {"width_px": 96, "height_px": 72, "egl": False},
}


def record(log: Path, frames: int = FRAMES, settings: wanderer.Config = SETTINGS) -> None:
    """Record what the wanderer receives and answers until so many frames are answered."""
    commands: list[MotorCommand] = []
    observer = Module("observer").on(topics.MOTOR_COMMAND, commands.append)
    modules = [
        registry.build("sim", _SECTIONS),
        registry.build("sensory", _SECTIONS),
        wanderer.build(settings),
        observer,
    ]
    with InProcessRunner(modules) as runner:
        recorded = [topics.SCAN, topics.MOTOR_COMMAND]
        recorder = Recorder(MemoryBus(runner.network), log, recorded, {})
        recorder.open()
        runner.run(until=lambda: len(commands) >= frames)
        recorder.close()


def replay(log: Path) -> Report:
    """Replay a log into the wanderer in Python."""
    return replay_into(log, ["motor"], _build, processes=1)


def _build(name: str, sections: Sections, instance: str) -> Module:
    """The wanderer in the place of the module that a log names."""
    return wanderer.build(SETTINGS, instance)


if __name__ == "__main__":
    LOG.unlink(missing_ok=True)
    record(LOG)
