"""What others may use of the player: how the logs of robots that others drove become senses."""

from __future__ import annotations

from cogmap.services.player.landmark_logs.delay import Delay
from cogmap.services.player.landmark_logs.sightings import sighting
from cogmap.services.player.landmark_logs.wheels import WheelNoise, Wheels

__all__ = ["Delay", "WheelNoise", "Wheels", "sighting"]
