"""When the agent last looked at ground ahead of where it was."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.graph.window import Window
from cogmap.schemas.nodes import PathColumn
from cogmap.services.codelets.planning.ground import COLUMNS, LOOK_M, Ground
from cogmap.services.codelets.planning.network import PlaceGrid
from cogmap.testing import agent

NOW_S = 1000.0
HERE = PlaceGrid((-10, -10), (60, 21), 1.0)


def _looked_ago_s(*rows: tuple[float, float, float]) -> Floats:
    """(w, h), of an agent that was at places x on one line, with a heading, each so long ago."""
    path = np.zeros((len(rows), len(PathColumn)))
    for row, (x_m, heading_rad, ago_s) in zip(path, rows, strict=True):
        row[PathColumn.X_M] = x_m
        row[PathColumn.HEADING_RAD] = heading_rad
        row[PathColumn.LAST_S] = NOW_S - ago_s

    window = Window(HERE.origin, COLUMNS, np.zeros((len(COLUMNS), *HERE.shape), np.float32))
    here = agent(stamp_ns=round(NOW_S * 1e9))
    return Ground(window, HERE, path, here).looked_ago_s(600.0)


def _at(x_m: int, ago_s: Floats) -> float:
    """How long ago a place on that line was looked at."""
    return float(ago_s[x_m + 10, 10])


def test_what_is_ahead_was_looked_at_as_far_as_the_agent_sees() -> None:
    ago_s = _looked_ago_s((0.0, 0.0, 60.0))

    assert _at(int(LOOK_M), ago_s) == pytest.approx(60.0)
    assert _at(int(LOOK_M) + 10, ago_s) == math.inf


def test_what_is_behind_was_not_looked_at() -> None:
    ago_s = _looked_ago_s((20.0, 0.0, 60.0))

    assert _at(10, ago_s) == math.inf


def test_the_last_look_counts() -> None:
    ago_s = _looked_ago_s((0.0, 0.0, 500.0), (5.0, 0.0, 60.0))

    assert _at(10, ago_s) == pytest.approx(60.0)
    assert _at(-2, ago_s) == pytest.approx(500.0)


@pytest.mark.parametrize("ago_s", [1.0, 700.0])
def test_a_look_counts_once_it_is_over_and_until_it_is_old(ago_s: float) -> None:
    assert _at(10, _looked_ago_s((0.0, 0.0, ago_s))) == math.inf
