"""A wheeled robot: two driven wheels and two casters under a body with a mast."""

from __future__ import annotations

import math

from cogmap.robot import MAX_WHEEL_RAD_S, TRACK_M, WHEEL_RADIUS_M
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.stdio import pybullet

# A made-up robot: 35 kg, which its motors speed up by 5.7 m/s2. The grip of its wheels is more than
# twice what that takes, so that they do not slip.
_MASS_KG = 30.0
_WHEEL_KG = 2.0
_CASTER_KG = 0.5
_TORQUE_NM = 20.0
_GRIP = 1.5
_CASTER_RADIUS_M = 0.1
_CASTER_FORWARD_M = 0.45
_WHEELS = (0, 1)
_UPRIGHT = (0, 0, 0, 1)


class Robot:
    """The robot's body in pybullet. Wheel speeds in rad/s, forward positive."""

    def __init__(self, client: int, start: Pose) -> None:
        self._client = client
        self.body = self._assemble()
        self.place(start)
        self.drive(0.0, 0.0)

    def drive(self, left_rad_s: float, right_rad_s: float) -> None:
        """Turn the wheels at these speeds, within what the motors can do."""
        pybullet.setJointMotorControlArray(
            self.body,
            _WHEELS,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[_within_limits(left_rad_s), _within_limits(right_rad_s)],
            forces=[_TORQUE_NM] * 2,
            physicsClientId=self._client,
        )

    def pose(self) -> Pose:
        """Return the middle of the axle, and the robot's heading."""
        (x_m, y_m, _), quaternion = self.position_and_orientation()
        _, _, heading_rad = pybullet.getEulerFromQuaternion(quaternion)

        return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    def position_and_orientation(
        self,
    ) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
        """Return the axle's middle in metres, and a quaternion (x, y, z, w)."""
        position_m, orientation = pybullet.getBasePositionAndOrientation(
            self.body, physicsClientId=self._client
        )
        return position_m, orientation

    def place(self, pose: Pose) -> None:
        """Put the robot there, at rest."""
        client = self._client
        rotation = upright_quaternion(pose.heading_rad)
        position_m = (pose.x_m, pose.y_m, WHEEL_RADIUS_M)
        pybullet.resetBasePositionAndOrientation(
            self.body, position_m, rotation, physicsClientId=client
        )

        still = (0, 0, 0)
        pybullet.resetBaseVelocity(self.body, still, still, physicsClientId=client)
        for wheel in _WHEELS:
            pybullet.resetJointState(self.body, wheel, 0.0, 0.0, physicsClientId=client)

    def _assemble(self) -> int:
        client = self._client
        # Spheres touch the ground in a point, so that the track is exactly TRACK_M.
        wheel = self._sphere(WHEEL_RADIUS_M)
        caster = self._sphere(_CASTER_RADIUS_M)
        caster_m = _CASTER_RADIUS_M - WHEEL_RADIUS_M + 0.002
        trunk = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=[0.5, 0.3, 0.1],
            collisionFramePosition=[0, 0, 0.08],
            physicsClientId=client,
        )
        body = pybullet.createMultiBody(
            _MASS_KG,
            trunk,
            -1,
            linkMasses=[_WHEEL_KG, _WHEEL_KG, _CASTER_KG, _CASTER_KG],
            linkCollisionShapeIndices=[wheel, wheel, caster, caster],
            linkVisualShapeIndices=[-1] * 4,
            linkPositions=[
                (0, TRACK_M / 2, 0),
                (0, -TRACK_M / 2, 0),
                (_CASTER_FORWARD_M, 0, caster_m),
                (-_CASTER_FORWARD_M, 0, caster_m),
            ],
            linkOrientations=[_UPRIGHT] * 4,
            linkInertialFramePositions=[(0, 0, 0)] * 4,
            linkInertialFrameOrientations=[_UPRIGHT] * 4,
            linkParentIndices=[0] * 4,
            linkJointTypes=[pybullet.JOINT_REVOLUTE] * 2 + [pybullet.JOINT_FIXED] * 2,
            linkJointAxis=[(0, 1, 0)] * 4,
            physicsClientId=client,
        )

        pybullet.changeDynamics(
            body, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client
        )
        for link, friction in enumerate((_GRIP, _GRIP, 0.0, 0.0)):
            pybullet.changeDynamics(body, link, lateralFriction=friction, physicsClientId=client)

        return int(body)

    def _sphere(self, radius_m: float) -> int:
        return int(
            pybullet.createCollisionShape(
                pybullet.GEOM_SPHERE,
                radius=radius_m,
                physicsClientId=self._client,
            )
        )


def upright_quaternion(heading_rad: float) -> tuple[float, float, float, float]:
    """Return the orientation (x, y, z, w) of a body that stands upright and heads there."""
    half_rad = heading_rad / 2
    return 0.0, 0.0, math.sin(half_rad), math.cos(half_rad)


def _within_limits(speed_rad_s: float) -> float:
    return max(-MAX_WHEEL_RAD_S, min(MAX_WHEEL_RAD_S, speed_rad_s))
