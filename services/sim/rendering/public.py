"""What others may use of the simulation's rendering: a world of pybullet, a stereo camera in it,
and light. All else is in `sim/public.py`, which needs no pybullet.
"""

from __future__ import annotations

from cogmap.services.sim.rendering.camera import StereoCamera
from cogmap.services.sim.rendering.light import Light, some_light
from cogmap.services.sim.world import World

__all__ = ["Light", "StereoCamera", "World", "some_light"]
