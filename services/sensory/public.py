"""What others may use of sensory memory: rectification, depth from stereo, and its settings."""

from __future__ import annotations

from cogmap.services.sensory.config import Config as SensoryConfig
from cogmap.services.sensory.disparity import STEPS_PER_PIXEL, DepthFromStereo, StereoMatcher
from cogmap.services.sensory.rectify import rectification

__all__ = ["STEPS_PER_PIXEL", "DepthFromStereo", "SensoryConfig", "StereoMatcher", "rectification"]
