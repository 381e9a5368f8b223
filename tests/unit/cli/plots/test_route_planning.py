"""The figure of experiment 3."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cogmap.cli.plots.route_planning import figure
from cogmap.experiments.route_planning.measure import EXAMPLE_GOALS, Planned

METRICS: dict[str, Any] = {
    "participants": 400.0,
    "participants_of_drawn_problems": 20.0,
    "flat_correlation_with_people": 0.1,
    "hierarchical_correlation_with_people": 0.7,
    "straightened_correlation_with_people": 0.5,
}


def _planned(name: str) -> Planned:
    tour = np.arange(EXAMPLE_GOALS)
    excess = np.array([0.1, 0.2])
    return Planned(
        name=name,
        positions=np.random.default_rng(1).uniform(size=(EXAMPLE_GOALS, 2)),
        shortest=tour,
        people=excess,
        hierarchical=excess,
        straightened=excess,
        flat=excess,
        typical=tour,
        typical_flat=tour,
    )


def _titles(sheet: Figure) -> list[str]:
    return [axes.get_title(loc="left")[:1] for axes in sheet.get_axes()]


def test_without_tours_of_people_there_is_no_panel_for_them() -> None:
    sheet = figure([], [_planned("drawn")], METRICS)

    assert sorted(_titles(sheet)) == ["a", "b", "c", "d", "e"]
    assert "people" not in sheet.get_suptitle()


def test_tours_of_people_have_two_panels() -> None:
    sheet = figure([_planned("Graph0")], [_planned("drawn")], METRICS)

    assert sorted(_titles(sheet)) == ["a", "b", "c", "d", "e", "f", "g"]
    assert "400 simulated participants on each problem of people" in sheet.get_suptitle()
