"""A wheeled robot: two driven wheels and two casters under a body with a mast."""

from __future__ import annotations

import math

from schemas.sensing import Pose
from services.sim.stdio import pybullet

TRACK_M = 0.8
WHEEL_RADIUS_M = 0.2
MAX_WHEEL_RAD_S = 30.0
_MASS_KG = 30.0
_WHEEL_KG = 2.0
_CASTER_KG = 0.5
_TORQUE_NM = 20.0
_GRIP = 1.5
_CASTER_RADIUS_M = 0.1
_CASTER_FORWARD_M = 0.45


class Robot:
    """The robot's body in pybullet. Wheel speeds in rad/s, forward positive."""

    def __init__(self, client: int, start: Pose) -> None:
        self._client = client
        self.body = self._assemble()
        self.place(start)
        self.drive(0.0, 0.0)

    def drive(self, left_rad_s: float, right_rad_s: float) -> None:
        """Turn the wheels at these speeds, as far as the motors can."""
        speeds = [max(-MAX_WHEEL_RAD_S, min(MAX_WHEEL_RAD_S, s)) for s in (left_rad_s, right_rad_s)]
        pybullet.setJointMotorControlArray(
            self.body,
            [0, 1],
            pybullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=[_TORQUE_NM] * 2,
            physicsClientId=self._client,
        )

    def pose(self) -> Pose:
        """Where the middle of the axle is, and where the robot heads."""
        (x, y, _), quaternion = self.position_and_orientation()
        heading = pybullet.getEulerFromQuaternion(quaternion)[2]
        return Pose(x_m=x, y_m=y, heading_rad=heading)

    def position_and_orientation(
        self,
    ) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
        """The axle's middle in metres, and a quaternion (x, y, z, w)."""
        position, orientation = pybullet.getBasePositionAndOrientation(
            self.body, physicsClientId=self._client
        )
        return position, orientation

    def place(self, pose: Pose) -> None:
        """Put the robot there, at rest."""
        turned = (0.0, 0.0, math.sin(pose.heading_rad / 2), math.cos(pose.heading_rad / 2))
        above = (pose.x_m, pose.y_m, WHEEL_RADIUS_M)
        pybullet.resetBasePositionAndOrientation(
            self.body, above, turned, physicsClientId=self._client
        )
        pybullet.resetBaseVelocity(self.body, (0, 0, 0), (0, 0, 0), physicsClientId=self._client)
        for wheel in (0, 1):
            pybullet.resetJointState(self.body, wheel, 0.0, 0.0, physicsClientId=self._client)

    def _assemble(self) -> int:
        client = self._client
        trunk = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=[0.5, 0.3, 0.1],
            collisionFramePosition=[0, 0, 0.08],
            physicsClientId=client,
        )
        # Spheres touch the ground in a point, so that the track is what it says.
        wheel = pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE, radius=WHEEL_RADIUS_M, physicsClientId=client
        )
        caster = pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE, radius=_CASTER_RADIUS_M, physicsClientId=client
        )
        low = _CASTER_RADIUS_M - WHEEL_RADIUS_M + 0.002
        places = [
            (0, TRACK_M / 2, 0),
            (0, -TRACK_M / 2, 0),
            (_CASTER_FORWARD_M, 0, low),
            (-_CASTER_FORWARD_M, 0, low),
        ]
        upright = [(0, 0, 0, 1)] * 4
        body = pybullet.createMultiBody(
            _MASS_KG,
            trunk,
            -1,
            linkMasses=[_WHEEL_KG, _WHEEL_KG, _CASTER_KG, _CASTER_KG],
            linkCollisionShapeIndices=[wheel, wheel, caster, caster],
            linkVisualShapeIndices=[-1] * 4,
            linkPositions=places,
            linkOrientations=upright,
            linkInertialFramePositions=[(0, 0, 0)] * 4,
            linkInertialFrameOrientations=upright,
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
