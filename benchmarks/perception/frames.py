"""How long a frame takes, from the stereo pair to the percepts, on a drive."""

from __future__ import annotations

import numpy as np

from benchmarks.perception.pipeline import PERIOD_S, PerceptionPipeline
from benchmarks.perception.scenes import drawn, drive

STEP_M = 0.3
WARM_UP = 20


def took_ms(seed: int, frames: int) -> list[float]:
    """Of so many `frames` of a drive through the town of `seed`, after a few to warm up."""
    with drawn(seed, 0, drive((WARM_UP + frames) * STEP_M, STEP_M)) as (_, camera, scenes):
        pairs = [(scene.left, scene.right) for scene in scenes]
    eyes = PerceptionPipeline(camera)
    results = [eyes.see(left, right, STEP_M / PERIOD_S) for left, right in pairs]
    return [result.took_ms for result in results[WARM_UP:]]


def figures(times_ms: list[float]) -> dict[str, float]:
    """Their median and their 99th percentile."""
    return {
        "frame_ms_p50": float(np.percentile(times_ms, 50)),
        "frame_ms_p99": float(np.percentile(times_ms, 99)),
    }
