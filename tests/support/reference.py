"""The reference: a small drive in lockstep, its log committed, with which every later version is
compared.

`python -m tests.support.reference --update` records it anew, which is how behaviour is changed on
purpose, and prints what has changed.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable
from functools import cache
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np

from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus
from cogmap.cli.launch.plan import Choices, effective
from cogmap.errors import LogError
from cogmap.graph.graph import Graph
from cogmap.recording.diff import Diff, diff
from cogmap.recording.recorder import Recorder
from cogmap.recording.selection import to_record
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta
from cogmap.schemas.topics import Scope
from cogmap.services import registry

REFERENCE = Path(__file__).parents[1] / "replay" / "reference.mcap"
FRAMES = 10
SMALL: Sections = {
    "sim": {"width_px": 96, "height_px": 72, "egl": False},
    "codelets": {"samples": 100, "kept_samples": 40, "landmark_samples": 40},
}
COMPARED = [topic for topic in topics.ALL if topic.scope is not Scope.PROCESS]
Published = dict[str, list[bytes]]


def sections(seed: int = 1) -> Sections:
    """The configuration of a small town drive in lockstep."""
    return effective(SMALL, Choices(seed=seed, lockstep=True, record=False), observer=False)


def drive(
    frames: int = FRAMES, seed: int = 1, workers: int = 1, log: Path | None = None
) -> Published:
    """Drive with every module in this process, until so many motor commands were published; log it
    where `log` is given.

    Returns the bytes of every message of the model and of the truth, by topic.
    """
    configured = sections(seed)
    runner = InProcessRunner(_modules(configured, workers))
    published: Published = defaultdict(list)
    _subscribe(MemoryBus(runner.network), published)

    recorder = None
    if log is not None:
        recorder = _recorder(MemoryBus(runner.network), log, configured)

    commands = published[topics.MOTOR_COMMAND.name]
    runner.run(lambda: len(commands) >= frames)
    runner.close()
    if recorder is not None:
        recorder.close()
    return dict(published)


def _modules(configured: Sections, workers: int) -> list[Module]:
    """Every module, and so many workers last."""
    modules = []
    for name in registry.MODULES:
        if name != "codelets":
            modules.append(registry.build(name, configured, name))
    for number in range(1, workers + 1):
        modules.append(registry.build("codelets", configured, f"codelets-{number}"))
    return modules


def _subscribe(bus: MemoryBus, published: Published) -> None:
    """Keep the bytes of every message of the model and of the truth."""

    def keep(arrival: Arrival) -> None:
        payload = bytes(arrival.payload)
        published[arrival.topic.name].append(payload)

    for topic in COMPARED:
        bus.subscribe(topic, keep, lambda name, number: None)


def _recorder(bus: MemoryBus, log: Path, configured: Sections) -> Recorder:
    about = {"config": json.dumps(configured), "arithmetic": json.dumps(arithmetic())}
    recorder = Recorder(bus, log, to_record(), about)
    recorder.open()
    return recorder


def graph(deltas: Iterable[Delta]) -> Graph:
    """The graph that `deltas` make, which are all there were."""
    made = Graph()
    for delta in deltas:
        if not made.apply(delta):
            raise ValueError(f"delta {delta.version} follows version {made.version}")
    return made


@cache
def arithmetic() -> dict[str, str]:
    """All that decides how the libraries round: they choose their code by the processor, and may
    differ in a last bit.

    numpy, OpenCV and BLAS each have variants of a function for each generation of processors; sines
    and exponentials come from the C library, which has variants too.
    """
    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    extensions = [*simd["baseline"], *simd.get("found", [])]
    facts = {
        "machine": platform.machine(),
        "processor": _processor(),
        "code of opencv": cv2.getCPUFeaturesLine(),
        "code of numpy": " ".join(extensions),
        "libc": " ".join(platform.libc_ver()),
    }
    for name in ("numpy", "opencv-python-headless", "pybullet"):
        facts[name] = version(name)
    return facts


def _processor() -> str:
    """Vendor, family and model, by which BLAS chooses."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()

    facts = dict.fromkeys(("vendor_id", "cpu family", "model"), "")
    for line in lines:
        name, _, value = line.partition(":")
        name = name.strip()
        if name in facts:
            facts[name] = value.strip()
    return " ".join(facts.values())


def other_arithmetic(log: Path = REFERENCE) -> str:
    """What this machine rounds differently with than the one that recorded `log`; empty where
    nothing.
    """
    about = LogReader(log).about(layout.RECORDING)
    there = json.loads(about["arithmetic"])
    here = arithmetic()
    differing = []
    for name in here | there:
        if here.get(name) != there.get(name):
            differing.append(f"{name} {here.get(name)!r}, there {there.get(name)!r}")
    return "; ".join(differing)


def compared(left: Path, right: Path) -> Diff:
    """How two drives compare, the truth included."""
    return diff(left, right, COMPARED)


def _compared_with_reference(fresh: Path) -> Diff | None:
    """How a drive compares with the reference; None where there is none that this version reads."""
    if not REFERENCE.exists():
        return None
    try:
        return compared(REFERENCE, fresh)
    except LogError:
        return None


def update() -> Diff | None:
    """Record the reference anew; how it compares with the old one, None where there was none that
    this version reads.
    """
    with tempfile.TemporaryDirectory() as folder:
        fresh = Path(folder) / "recorded anew"
        drive(log=fresh)
        changed = _compared_with_reference(fresh)
        if changed is None or not changed.same or other_arithmetic():
            REFERENCE.write_bytes(fresh.read_bytes())
    return changed


def in_words(changed: Diff | None) -> str:
    """What an update has changed."""
    if changed is None:
        return f"{REFERENCE.name} is new"
    if changed.same:
        return f"every message in {REFERENCE.name} is as it was"
    lines = []
    for topic in changed.topics:
        if topic.first:
            counts = (
                f"{topic.same} the same, {topic.different} changed, "
                f"{topic.left_only} gone, {topic.right_only} new"
            )
            lines.append(f"{topic.topic}: {counts}\n  {topic.first}")
    return "\n".join(lines)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.reference", description=__doc__)
    parser.add_argument(
        "--update", action="store_true", required=True, help="record it anew and print what changed"
    )
    parser.parse_args()
    sys.stdout.write(f"{in_words(update())}\n")


if __name__ == "__main__":
    main()
