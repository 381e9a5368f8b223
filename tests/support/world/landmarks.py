"""Landmarks, motions and the codelets of localization run on them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cogmap.schemas.array import Array
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import Object, Self
from cogmap.services.codelets.config import Config
from cogmap.testing import graph_of, landmark, task
from tests.support.world.scenes import run

EXACT = Config(samples=4000, kept_samples=2000, landmarks="points")
Row = tuple[float, float, float, float, float]


def house(
    x_m: float,
    y_m: float,
    sd_m: float = 0.01,
    label: str = "house",
    sightings: int = 20,
    **facts: Any,
) -> Object:
    """A landmark about a position, with 200 samples of it."""
    rng = np.random.default_rng(5)
    samples_m = rng.normal((x_m, y_m), sd_m, (200, 2))
    return landmark(label, samples_m, sightings=sightings, **facts)


def motions(*rows: Row) -> Array:
    """Self-motion: speed, turn rate, duration and the deviations of the first two, row by row."""
    return Array.of(np.array(rows, np.float64))


def localized(*nodes: Operation, config: Config = EXACT, **facts: Any) -> Self:
    """The self node that localization writes on a graph of these nodes."""
    asked = task("localization", **facts)
    found, _ = run(asked, graph_of(*nodes), config).operations
    assert isinstance(found, Self)
    return found


def samples_of(agent: Self) -> npt.NDArray[np.float64]:
    """The samples of the agent's pose."""
    return agent.samples.numpy()


def pose_of(agent: Self) -> tuple[float, float, float]:
    """The mean pose of the agent."""
    return agent.x_m, agent.y_m, agent.heading_rad


def normal_samples(*sd: float, count: int = 4000) -> npt.NDArray[np.float64]:
    """Samples about the origin with a standard deviation for each column."""
    return np.random.default_rng(1).normal(0.0, sd, (count, len(sd)))
