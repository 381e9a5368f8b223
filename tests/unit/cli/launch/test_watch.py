"""What the launcher measures of what it receives from the bus, and the map that it draws."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.text import Text

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.launch.drive_metrics import DriveMetrics, RunMetrics, drive_metrics
from cogmap.cli.launch.watch import Watch
from cogmap.cli.plots.map import picture as plot
from cogmap.cli.run.summary import drive_rows
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Cells, Delta, DropNode, Phase
from cogmap.schemas.nodes import PlaceColumn
from cogmap.schemas.process import Health
from cogmap.schemas.sensing import (
    Energy,
    MotorCommand,
    Odometry,
    Pose,
    SelfMotion,
    SpeedLimit,
    TruePose,
)
from cogmap.services.sim.layout.town import generate
from cogmap.testing import agent, landmark

MS = 1_000_000


class Publisher:
    """Publishes messages as a module would, each taken in before the next."""

    def __init__(self, network: MemoryNetwork, watch: Watch) -> None:
        self._bus = MemoryBus(network)
        self._watch = watch

    def publish(
        self, message: Message, sent_ns: int = 0, stages: list[tuple[str, int, int]] | None = None
    ) -> bool:
        message = msgspec.structs.replace(message, source="somebody")
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
def publisher(network: MemoryNetwork, watch: Watch) -> Publisher:
    return Publisher(network, watch)


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


STEP_NS = 200 * MS


def drive(publisher: Publisher) -> None:
    """Two steps of 1 m along South Street, and one building learned a metre from where it stands.

    The wheels measure 1.1 m a step, the fused self-motion 0.85 m; the estimate is 0.1 m off.
    """
    publisher.publish(generate(1).message())
    for step in range(3):
        move(publisher, step)
    publisher.publish(learned())


def move(publisher: Publisher, step: int) -> None:
    start = generate(1).start
    stamp_ns = step * STEP_NS
    pose = Pose(x_m=start.x_m + step, y_m=start.y_m, heading_rad=0.0)
    true = TruePose(
        seq=step, stamp_ns=stamp_ns, pose=pose, travelled_m=float(step), progress=step / 2
    )
    publisher.publish(true)
    if not step:
        return

    wheels = Odometry(seq=step - 1, stamp_ns=stamp_ns, speed_m_s=5.5, turn_rate_rad_s=0.0, dt_s=0.2)
    fused = SelfMotion(
        seq=step - 1,
        stamp_ns=stamp_ns,
        frame=step,
        since_ns=stamp_ns - STEP_NS,
        motions=Array.of([[4.25, 0.0, 0.2, 0.1, 0.1]], "<f8"),
    )
    publisher.publish(wheels)
    publisher.publish(fused)


def learned() -> Delta:
    town = generate(1)
    building = town.message().buildings[0]
    x_m = building.pose.x_m - town.start.x_m + 1.0
    y_m = building.pose.y_m - town.start.y_m
    samples = np.random.default_rng(0).normal([x_m, y_m], 0.5, (50, 2))
    operations = [
        agent(x_m=2.1, stamp_ns=2 * STEP_NS),
        landmark(building.name, samples, x_m=x_m, y_m=y_m),
        Cells(
            column=PlaceColumn.ROAD,
            cells=Array.of([[0, 0], [1, 0]], "<i4"),
            values=Array.of(np.ones(2, np.float32)),
        ),
    ]
    return Delta(
        stamp_ns=2 * STEP_NS,
        version=1,
        cycle=1,
        phase=Phase.LOCALIZATION,
        tasks=[],
        operations=operations,
    )


def metrics_of(watch: Watch) -> DriveMetrics:
    return drive_metrics(watch.tally, watch.gaps(), watch.rejected())


def test_the_metrics_are_of_the_drive_and_of_what_was_learned(
    watch: Watch, publisher: Publisher
) -> None:
    drive(publisher)
    metrics = metrics_of(watch)

    assert metrics.estimates == 1
    assert (metrics.objects, metrics.road_m2, metrics.deltas) == (1, 2.0, 1)
    assert metrics.buildings is not None
    assert (metrics.buildings.on_map, metrics.buildings.seen) == (0, 0)


def test_errors_of_the_estimate_the_wheels_and_fused_self_motion_are_apart(
    watch: Watch, publisher: Publisher
) -> None:
    drive(publisher)
    metrics = metrics_of(watch)

    assert metrics.estimate.mean_m == pytest.approx(0.1)
    assert metrics.wheels_alone.mean_m == pytest.approx(0.2)
    assert metrics.fused_alone.mean_m == pytest.approx(0.3)
    assert metrics.error_ratio == pytest.approx(0.1 / 0.2)
    assert metrics.error_over_fused == pytest.approx(0.1 / 0.3)


def command(seq: int = 0, speed_rad_s: float = 0.0, **limits: SpeedLimit) -> MotorCommand:
    return MotorCommand(
        seq=seq, left_wheel_rad_s=speed_rad_s, right_wheel_rad_s=speed_rad_s, **limits
    )


def test_a_cycle_is_timed_from_the_frame_to_the_command(watch: Watch, publisher: Publisher) -> None:
    halt = command(halted_by=SpeedLimit.OBSTACLE)
    stages = [("sensory", 20 * MS, 5 * MS), ("motor", 10 * MS, 5 * MS)]
    publisher.publish(halt, sent_ns=40 * MS, stages=stages)
    metrics = metrics_of(watch)

    assert metrics.commands == 1
    assert metrics.halted == {"obstacle": 1}
    assert metrics.cycle_p50_ms == pytest.approx(40.0)
    assert metrics.bus_share == pytest.approx(0.25)


def test_what_slowed_or_halted_the_robot_is_counted_by_reason(
    watch: Watch, publisher: Publisher
) -> None:
    publisher.publish(command(0, 1.0, slowed_by=SpeedLimit.POSE_AGE))
    publisher.publish(command(1, 1.0, slowed_by=SpeedLimit.NONE))
    publisher.publish(command(2, 1.0, slowed_by=SpeedLimit.BEND))
    slow_share = watch.tally.share_limited_by(SpeedLimit.POSE_AGE)

    assert metrics_of(watch).slowed == {"pose age": 1, "bend": 1}
    assert slow_share == pytest.approx(1 / 3)


def test_the_energy_is_that_at_its_lowest_and_each_charging_counts_once(
    watch: Watch, publisher: Publisher
) -> None:
    levels = [(0.6, False), (0.3, False), (0.4, True), (0.5, True), (0.45, False), (0.5, True)]
    for number, (level, is_charging) in enumerate(levels):
        stamp_ns = number * STEP_NS
        energy = Energy(
            seq=number, stamp_ns=stamp_ns, frame=number, level=level, is_charging=is_charging
        )
        publisher.publish(energy)

    energy_metrics = metrics_of(watch).energy
    assert energy_metrics is not None
    assert energy_metrics.lowest == 0.3
    assert energy_metrics.final == 0.5
    assert energy_metrics.charged == 2
    assert not energy_metrics.ran_out


def test_a_drive_without_energy_has_no_metrics_of_it(watch: Watch) -> None:
    assert metrics_of(watch).energy is None


def test_gaps_are_those_of_whoever_missed_most(watch: Watch, publisher: Publisher) -> None:
    publisher.publish(health("epam", {"odometry": 3}, busy=0.2))
    publisher.publish(health("sensory", {"odometry": 5, "camera/stereo": 9}))
    publisher.publish(health("epam", {"odometry": 3}, busy=0.4))

    gaps = watch.gaps()

    assert gaps["odometry"] == 5
    assert "camera/stereo" not in gaps
    assert watch.rejected() == {"odometry": 4}
    assert watch.tally.busy == {"epam": pytest.approx(0.3), "sensory": 0.5}


def test_dropped_answers_are_counted_and_the_last_reasons_kept(
    watch: Watch, publisher: Publisher
) -> None:
    for version in range(1, 12):
        refused = [f"proposal {version} is late"]
        publisher.publish(
            Delta(
                seq=version,
                version=version,
                cycle=1,
                phase=Phase.END,
                tasks=[],
                operations=[],
                rejected=2,
                reasons=refused,
            )
        )
    metrics = metrics_of(watch)

    assert metrics.dropped == 22
    assert metrics.refused == [f"proposal {version} is late" for version in range(4, 12)]


def test_an_object_that_left_the_map_is_named(watch: Watch, publisher: Publisher) -> None:
    inn = landmark("inn")
    unknown = DropNode(id="object:nowhere")
    for seq, operation in enumerate((inn, DropNode(id=inn.id), unknown)):
        publisher.publish(
            Delta(seq=seq, version=seq + 1, cycle=1, phase=Phase.END, operations=[operation])
        )
    metrics = metrics_of(watch)

    assert metrics.objects == 0
    assert metrics.forgotten == ["inn"]


def test_it_is_quiet_when_only_health_arrives(watch: Watch, publisher: Publisher) -> None:
    town = generate(1).message()
    report = health("epam", {})

    assert publisher.publish(town)
    assert not publisher.publish(report)
    assert not watch.pump(0.0)


def test_the_map_of_a_drive_and_of_none_is_drawn(
    watch: Watch, publisher: Publisher, tmp_path: Path
) -> None:
    for name in ("none.png", "drive.png"):
        plot.draw(tmp_path / name, watch.tally, run_metrics(watch))
        drive(publisher)

    assert (tmp_path / "none.png").stat().st_size < (tmp_path / "drive.png").stat().st_size


def test_the_summary_names_the_first_goals_that_were_not_reached(watch: Watch) -> None:
    unreached = {f"goal {number}": "no [route]" for number in range(10)}
    metrics = msgspec.structs.replace(metrics_of(watch), unreached=unreached)
    lines = dict(drive_rows(metrics))["not reached"].splitlines()

    assert len(lines) == 9
    assert Text.from_markup(lines[0]).plain == "goal 0: no [route]"
    assert lines[-1] == "and 2 more"
    assert "not reached" not in dict(drive_rows(metrics_of(watch)))


@pytest.mark.parametrize(("limited", "is_slow"), [(29, False), (31, True)])
def test_the_summary_names_a_machine_that_is_too_slow(
    watch: Watch, limited: int, is_slow: bool
) -> None:
    slowed = {SpeedLimit.POSE_AGE.value: limited}
    metrics = msgspec.structs.replace(
        metrics_of(watch), commands=100, slowed=slowed, cycle_p50_ms=812.0
    )
    row = dict(drive_rows(metrics)).get("machine", "")

    assert row.startswith("too slow for real time: a cycle takes 812 ms") == is_slow


def run_metrics(watch: Watch) -> RunMetrics:
    return RunMetrics(
        **msgspec.structs.asdict(metrics_of(watch)),
        completed=True,
        ended_by="route complete",
        reason="the agent was at every goal: corner 1",
        town="loop",
        seed=1,
        lockstep=False,
        codelets=1,
        wall_s=1.0,
        start_s={},
        restarts={},
        killed=[],
        log=None,
    )
