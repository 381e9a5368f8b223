"""The battery runs down as the robot drives, and is charged where it stands at a charging place."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from cogmap.bus.codec import decode, encode
from cogmap.errors import ConfigError
from cogmap.runtime.run import LOCKSTEP, Run
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import (
    Energy,
    MotorCommand,
    Percepts,
    Pose,
    StereoFrame,
    TruePose,
    TrueTown,
)
from cogmap.services.sim.battery import Battery, PowerSupply
from cogmap.services.sim.layout.furniture import CHARGING_PLACE
from cogmap.services.sim.module import Config, build
from cogmap.services.sim.trajectory import Trajectory
from cogmap.testing import of_type

HERE = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
BATTERY = Battery(capacity_s=100.0, cost_per_m=0.01, charge_s=10.0, charge_within_m=5.0)
SMALL = {"width_px": 64, "height_px": 64}
SUPPLIED = Run(lockstep=True, energy=True)


def _config(**settings: Any) -> Config:
    everyday: dict[str, Any] = {"town": "blocks", "sensing": "percepts"}
    return Config(**{**everyday, **settings})


def _drive(
    config: Config, frames: int, past: list[TruePose] | None = None, run: Run = SUPPLIED
) -> list[Message]:
    """What a robot that drives straight on publishes, perhaps after a restart."""
    module = build(config, run=run)
    assert module.start is not None
    if past is not None:
        assert module.restore is not None
        module.restore(past)

    kind = Percepts if config.sensing == "percepts" else StereoFrame
    new = module.stamp(module.start())
    published = [*new]
    for _ in range(frames - 1):
        (seen,) = of_type(kind, new)
        command = MotorCommand(
            stamp_ns=seen.stamp_ns, left_wheel_rad_s=15.0, right_wheel_rad_s=15.0
        )
        new = module.feed(command)
        published += new

    return published


def test_a_battery_at_rest_lasts_for_its_capacity() -> None:
    power = PowerSupply(BATTERY, [])
    power.advance(HERE, 0.0, 25.0)

    assert power.level == pytest.approx(0.75)


def test_each_metre_costs_its_share_beside_the_time() -> None:
    power = PowerSupply(BATTERY, [(0.0, 0.0)])
    power.advance(HERE, 10.0, 5.0)

    assert power.level == pytest.approx(1.0 - 0.05 - 0.1)


@pytest.mark.parametrize(("place_m", "expected"), [((3.0, 3.9), 0.7), ((3.0, 4.1), 0.48)])
def test_a_robot_that_stands_near_enough_is_charged(
    place_m: tuple[float, float], expected: float
) -> None:
    power = PowerSupply(BATTERY, [place_m])
    power.resume(0.5)
    power.advance(HERE, 0.0, 2.0)

    assert power.level == pytest.approx(expected)


def test_a_robot_that_passes_a_charging_place_is_not_charged() -> None:
    power = PowerSupply(BATTERY, [(0.0, 1.0)])
    power.resume(0.5)
    power.advance(HERE, 1.0, 1.0)

    (sensed,) = power.sensed(0, 0)
    assert isinstance(sensed, Energy)
    assert not sensed.is_charging
    assert sensed.level < 0.5


def test_a_battery_is_charged_until_it_is_full() -> None:
    power = PowerSupply(BATTERY, [(0.0, 1.0)])
    power.resume(0.9)
    power.advance(HERE, 0.0, 3.0)

    assert power.level == 1.0


def test_a_robot_that_is_out_stays_out_at_a_charging_place() -> None:
    power = PowerSupply(BATTERY, [(0.0, 1.0)])
    power.resume(0.0)
    power.advance(HERE, 0.0, 3.0)

    assert power.is_out
    assert power.level == 0.0


def test_the_energy_is_sensed_once_with_each_view_and_falls() -> None:
    published = _drive(_config(), 20)
    sensed = of_type(Energy, published)
    views = of_type(Percepts, published)

    assert [each.stamp_ns for each in sensed] == [view.stamp_ns for view in views]
    assert [each.frame for each in sensed] == [view.frame for view in views]
    levels = [each.level for each in sensed]
    assert levels == sorted(levels, reverse=True)
    assert levels[0] > levels[-1]


def test_the_energy_is_sensed_with_cameras_too() -> None:
    published = _drive(_config(sensing="cameras", town="loop", **SMALL), 3)

    sensed = of_type(Energy, published)
    frames = of_type(StereoFrame, published)
    assert [each.stamp_ns for each in sensed] == [frame.stamp_ns for frame in frames]
    assert sensed[-1].level == of_type(TruePose, published)[-1].energy


@pytest.mark.parametrize("sensing", ["percepts", "cameras"])
def test_a_robot_that_is_out_drives_no_farther(sensing: str) -> None:
    battery = Battery(cost_per_m=1.0)
    published = _drive(_config(sensing=sensing, town="loop", battery=battery, **SMALL), 25)

    truths = of_type(TruePose, published)
    assert truths[-1].energy == 0.0
    assert 1.0 < truths[-1].travelled_m < 3.0
    assert truths[-1].travelled_m == pytest.approx(truths[-5].travelled_m, abs=1e-3)


def test_a_simulation_that_was_killed_continues_with_its_energy() -> None:
    truths = of_type(TruePose, _drive(_config(), 30))
    (again,) = of_type(TruePose, _drive(_config(), 1, past=truths))

    assert truths[-1].energy < 1.0
    assert again.energy < truths[-1].energy
    assert again.energy == pytest.approx(truths[-1].energy, abs=1e-3)


def test_the_same_seed_gives_the_same_bytes_with_energy() -> None:
    first = [encode(message) for message in _drive(_config(), 20)]

    assert [encode(message) for message in _drive(_config(), 20)] == first


def test_without_energy_nothing_of_it_is_published() -> None:
    published = _drive(_config(), 5, run=LOCKSTEP)

    assert of_type(Energy, published) == []
    assert b"energy" not in b"".join(encode(message) for message in published)
    (town,) = of_type(TrueTown, published)
    assert all(obstacle.kind != CHARGING_PLACE for obstacle in town.obstacles)


def test_energy_changes_no_percept_of_a_building() -> None:
    def buildings(run: Run) -> list[list[object]]:
        views = of_type(Percepts, _drive(_config(), 40, run=run))
        return [[each for each in view.objects if each.function != "charge"] for view in views]

    assert buildings(SUPPLIED) == buildings(LOCKSTEP)


def test_a_true_pose_without_energy_reads_back_without_it() -> None:
    truth = TruePose(pose=HERE, travelled_m=1.0, progress=0.5)

    assert decode(topics.TRUE_POSE, encode(truth)) == truth
    assert truth.energy is msgspec.UNSET


def test_a_trajectory_with_energy_is_refused() -> None:
    line = Trajectory(line_m=[(0.0, 0.0), (9.0, 0.0)], landmarks=[])

    with pytest.raises(ConfigError, match=r"set run\.energy to false"):
        build(Config(trajectory=line), run=SUPPLIED)
