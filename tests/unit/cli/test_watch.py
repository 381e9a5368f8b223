"""What the launcher makes of what it hears on the bus, and the map that it draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cli.launch.metrics import Figures, measured
from cli.launch.watch import Watch
from cli.plots import map as picture
from cogmap.bus.codec import Envelope, encode
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.graph import Cells, Delta, Node
from schemas.process import Health
from schemas.sensing import MotorCommand, Odometry, TruePose
from services.sim.layout.town import generate

MS = 1_000_000


class Speaker:
    """Publishes messages as a module would, each taken in before the next."""

    def __init__(self, network: MemoryNetwork, watch: Watch) -> None:
        self._bus = MemoryBus(network)
        self._watch = watch

    def say(
        self, message: Message, sent_ns: int = 0, stages: list[tuple[str, int, int]] | None = None
    ) -> bool:
        message.source = "somebody"
        envelope = Envelope(message.source, message.seq, 1, sent_ns, 0, stages or [])
        self._bus.publish(topics.of(message), encode(message), envelope)
        return self._watch.pump(0.0)


@pytest.fixture
def network() -> MemoryNetwork:
    return MemoryNetwork()


@pytest.fixture
def watch(network: MemoryNetwork) -> Watch:
    return Watch(MemoryBus(network))


@pytest.fixture
def speaker(network: MemoryNetwork, watch: Watch) -> Speaker:
    return Speaker(network, watch)


def health(instance: str, gaps: dict[str, int], busy: float = 0.5) -> Health:
    return Health(
        module=instance,
        instance=instance,
        ready=True,
        uptime_s=1.0,
        received={},
        emitted={},
        rejected={"odometry": 2},
        superseded={},
        gaps=gaps,
        queued=0,
        busy=busy,
        compute_p50_ms=1.0,
        compute_p99_ms=2.0,
        memory_mb=10.0,
    )


def drive(speaker: Speaker) -> None:
    """Two steps along South Street, one building learned a metre from where it stands."""
    town = generate(1)
    building = town.message().buildings[0]
    speaker.say(town.message())
    for step in range(3):
        pose = town.start
        pose = type(pose)(x_m=pose.x_m + step, y_m=pose.y_m, heading_rad=0.0)
        stamp_ns = step * 200 * MS
        speaker.say(
            TruePose(
                seq=step, stamp_ns=stamp_ns, pose=pose, travelled_m=float(step), progress=step / 2
            )
        )
        if step:
            motion = Odometry(
                seq=step - 1, stamp_ns=stamp_ns, speed_m_s=5.5, turn_rate_rad_s=0.0, dt_s=0.2
            )
            speaker.say(motion)
    place = {
        "x_m": building.pose.x_m - town.start.x_m + 1.0,
        "y_m": building.pose.y_m - town.start.y_m,
    }
    samples = Array.of(np.random.default_rng(0).normal(list(place.values()), 0.5, (50, 2)))
    operations = [
        Node(id="self", kind="self", attributes={"x_m": 2.1, "y_m": 0.0, "heading_rad": 0.0}),
        Node(
            id="object:x",
            kind="object",
            attributes={"label": building.name, **place},
            samples=samples,
        ),
        Cells(
            column="road",
            cells=Array.of([[0, 0], [1, 0]], "<i4"),
            values=Array.of(np.ones(2, np.float32)),
        ),
    ]
    speaker.say(
        Delta(
            stamp_ns=400 * MS,
            version=1,
            cycle=1,
            phase="localization",
            tasks=[],
            operations=operations,
        )
    )


def figures_of(watch: Watch) -> dict[str, object]:
    return measured(watch, watch.observer.errors())


def test_the_figures_tell_the_drive_and_what_was_learned(watch: Watch, speaker: Speaker) -> None:
    drive(speaker)
    figures = figures_of(watch)
    assert figures["estimates"] == 1
    assert figures["error_ratio"] == pytest.approx(0.1 / 0.2)
    assert (figures["objects"], figures["road_m2"], figures["deltas"]) == (1, 2.0, 1)
    assert figures["object_error_mean_m"] == pytest.approx(1.0)


def test_a_cycle_is_timed_from_the_frame_to_the_command(watch: Watch, speaker: Speaker) -> None:
    command = MotorCommand(left_wheel_rad_s=0.0, right_wheel_rad_s=0.0, halted_by="obstacle")
    stages = [("sensory", 20 * MS, 5 * MS), ("action", 10 * MS, 5 * MS)]
    speaker.say(command, sent_ns=40 * MS, stages=stages)
    figures = figures_of(watch)
    assert (figures["commands"], figures["halted"]) == (1, {"obstacle": 1})
    assert figures["cycle_p50_ms"] == pytest.approx(40.0)
    assert figures["bus_share"] == pytest.approx(0.25)


def test_gaps_are_those_of_whoever_missed_most(watch: Watch, speaker: Speaker) -> None:
    speaker.say(health("epam", {"odometry": 3}, busy=0.2))
    speaker.say(health("sensory", {"odometry": 5, "camera/stereo": 9}))
    speaker.say(health("epam", {"odometry": 3}, busy=0.4))
    assert watch.gaps()["odometry"] == 5
    assert "camera/stereo" not in watch.gaps()
    assert watch.rejected() == {"odometry": 4}
    assert watch.busy == {"epam": pytest.approx(0.3), "sensory": 0.5}


def test_answers_that_were_dropped_are_counted_and_the_reasons_of_the_last_are_kept(
    watch: Watch, speaker: Speaker
) -> None:
    for version in range(1, 12):
        refused = [f"proposal {version} is late"]
        speaker.say(
            Delta(
                seq=version,
                version=version,
                cycle=1,
                phase="decay",
                tasks=[],
                operations=[],
                dropped=2,
                refused=refused,
            )
        )
    figures = measured(watch, watch.observer.errors())
    assert figures["dropped"] == 22
    assert figures["refused"] == [f"proposal {version} is late" for version in range(4, 12)]


def test_quiet_is_when_only_health_is_told(watch: Watch, speaker: Speaker) -> None:
    assert speaker.say(generate(1).message())
    assert not speaker.say(health("epam", {}))
    assert not watch.pump(0.0)


def test_the_map_of_a_drive_and_of_none_is_drawn(
    watch: Watch, speaker: Speaker, tmp_path: Path
) -> None:
    facts = {
        "completed": True,
        "ended_by": "route complete",
        "seed": 1,
        "laps": 1.0,
        "mode": "real_time",
    }
    more = {"codelets": 1, "wall_s": 1.0, "start_s": {}, "restarts": {}, "killed": [], "log": None}
    for name in ("none.png", "drive.png"):
        figures = Figures(**facts, **more, **figures_of(watch))
        picture.draw(tmp_path / name, watch.observer, watch.replica.graph, figures)
        drive(speaker)
    assert (tmp_path / "none.png").stat().st_size < (tmp_path / "drive.png").stat().st_size
