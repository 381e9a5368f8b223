"""How long a frame takes, from the stereo pair to the percepts, on a drive."""

from __future__ import annotations

import numpy as np

from benchmarks.perception.pipeline import PERIOD_S, PerceptionPipeline
from benchmarks.perception.scenes import drawn, drive
from benchmarks.report import Metrics

STEP_M = 0.3
WARM_UP = 20


def times_ms(seed: int, frames: int) -> list[float]:
    """Of so many `frames` of a drive through the town of `seed`, after a few to warm up."""
    length_m = (WARM_UP + frames) * STEP_M
    path = drive(length_m, STEP_M)

    with drawn(seed, 0, path) as (_, camera, scenes):
        pairs = [(scene.left, scene.right) for scene in scenes]

    pipeline = PerceptionPipeline(camera)
    speed_m_s = STEP_M / PERIOD_S
    took_ms = []
    for left, right in pairs:
        result = pipeline.process(left, right, speed_m_s)
        took_ms.append(result.took_ms)

    return took_ms[WARM_UP:]


def metrics(took_ms: list[float]) -> Metrics:
    """The median and the 99th percentile of the times of frames."""
    return {
        "frame_ms_p50": float(np.percentile(took_ms, 50)),
        "frame_ms_p99": float(np.percentile(took_ms, 99)),
    }
