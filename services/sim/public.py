"""What others may use of the simulation without rendering: its towns, the noise of its odometry,
and what a camera sees at the level of percepts.
"""

from __future__ import annotations

from cogmap.services.sim import odometry
from cogmap.services.sim.config import Config as SimConfig
from cogmap.services.sim.config import place_of
from cogmap.services.sim.layout import town
from cogmap.services.sim.layout.barriers import barriers
from cogmap.services.sim.layout.boundaries import outlines
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import STREET_WIDTH_M
from cogmap.services.sim.percept_level import column_camera, town_sensors
from cogmap.services.sim.percept_level.surroundings import Surroundings

__all__ = [
    "CATALOGUE",
    "STREET_WIDTH_M",
    "Place",
    "SimConfig",
    "Surroundings",
    "barriers",
    "column_camera",
    "odometry",
    "outlines",
    "place_of",
    "town",
    "town_sensors",
]
