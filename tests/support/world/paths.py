"""Messages of a drive whose truth is known, a tick apart."""

from __future__ import annotations

from cogmap.evaluation.paths import Paths
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Delta, DropNode, Phase
from cogmap.schemas.sensing import Odometry, Pose, SelfMotion, TruePose
from cogmap.testing import agent
from cogmap.testing import odometry as wheels

TICK_NS = 50_000_000
TICK_S = 0.05


def true_pose(tick: int, x_m: float, y_m: float, heading_rad: float = 0.0) -> TruePose:
    pose = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
    return TruePose(stamp_ns=tick * TICK_NS, pose=pose, travelled_m=x_m, progress=0.5)


def odometry(tick: int, speed_m_s: float, turn_rate_rad_s: float = 0.0) -> Odometry:
    return wheels(0, speed_m_s, turn_rate_rad_s, stamp_ns=tick * TICK_NS, dt_s=TICK_S)


def estimate(
    tick: int,
    x_m: float,
    y_m: float,
    *,
    version: int = 1,
    committed_tick: int | None = None,
    heading_rad: float = 0.0,
) -> Delta:
    pose = agent(x_m=x_m, y_m=y_m, heading_rad=heading_rad, stamp_ns=tick * TICK_NS)
    operations = [DropNode(id="object:inn"), pose]
    return Delta(
        stamp_ns=(tick if committed_tick is None else committed_tick) * TICK_NS,
        version=version,
        cycle=1,
        phase=Phase.LOCALIZATION,
        tasks=[],
        operations=operations,
    )


def self_motion(tick: int, speed_m_s: float, turn_rate_rad_s: float = 0.0) -> SelfMotion:
    """Of the two halves of one tick."""
    half = [speed_m_s, turn_rate_rad_s, 0.025, 0.1, 0.1]
    return SelfMotion(
        stamp_ns=tick * TICK_NS,
        frame=tick,
        since_ns=(tick - 1) * TICK_NS,
        motions=Array.of([half, half], "<f8"),
    )


def straight_drive(
    paths: Paths, ticks: int, wheel_speed_m_s: float, fused_speed_m_s: float = 1.0
) -> None:
    """Let the robot drive 1 m/s along x in truth."""
    paths.update(true_pose(0, 0.0, 0.0))
    for tick in range(1, ticks + 1):
        paths.update(odometry(tick, wheel_speed_m_s))
        paths.update(self_motion(tick, fused_speed_m_s))
        paths.update(true_pose(tick, TICK_S * tick, 0.0))
