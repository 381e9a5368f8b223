"""A town in lockstep, with modules of one's own and an observer."""

from __future__ import annotations

import pytest

from cogmap import CogmapError, MessageError, Module, topics
from cogmap.schemas.sensing import MotorCommand, RangeScan, TruePose
from cogmap.testing import Town


def test_an_agent_explores_and_its_graph_is_followed() -> None:
    with Town() as town:
        town.run(seconds=4.0)

        assert town.true_poses[-1].stamp_ns >= 4 * 10**9
        assert town.true_poses[-1].travelled_m > 0.5
        assert town.graph.agent is not None


def test_the_same_seed_gives_the_same_drive() -> None:
    drives: list[list[TruePose]] = []
    for _ in range(2):
        with Town(seed=3) as town:
            town.run(seconds=2.0)
            drives.append(town.true_poses)

    assert drives[0] == drives[1]


def test_it_runs_on_from_where_it_stood() -> None:
    with Town() as town:
        town.run(seconds=1.0)
        before = len(town.true_poses)
        town.run(seconds=1.0)

    assert len(town.true_poses) == pytest.approx(2 * before, abs=1)


def _standing() -> Module:
    """A motor that turns no wheel."""

    def on_scan(scan: RangeScan) -> MotorCommand:
        return MotorCommand(stamp_ns=scan.stamp_ns, left_wheel_rad_s=0.0, right_wheel_rad_s=0.0)

    return Module("motor").on(topics.SCAN, on_scan, emits=[topics.MOTOR_COMMAND])


def test_a_module_of_ones_own_takes_the_place_of_ours() -> None:
    with Town(modules=[_standing()], observe=[topics.MOTOR_COMMAND]) as town:
        town.run(seconds=2.0)

    assert {command.source for command in town.observer.of(MotorCommand)} == {"motor"}
    assert town.true_poses[-1].travelled_m == pytest.approx(0.0, abs=1e-6)


def test_settings_come_before_those_of_the_town() -> None:
    with Town(settings={"sim": {"frame_hz": 2}}, observe=[topics.MOTOR_COMMAND]) as town:
        town.run(seconds=2.0)

    assert len(town.observer.of(MotorCommand)) < 6


def test_a_message_that_a_module_rejects_is_an_error() -> None:
    def reject(pose: TruePose) -> None:
        raise MessageError("of no use")

    with (
        Town(modules=[Module("critic").on(topics.TRUE_POSE, reject)]) as town,
        pytest.raises(CogmapError, match="critic rejected"),
    ):
        town.run(seconds=1.0)
