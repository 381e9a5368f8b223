"""The figure of the ablation."""

from __future__ import annotations

import math

from cogmap.cli.plots.ablation import figure
from cogmap.experiments.ablation.measure import Domain
from cogmap.experiments.ablation.outcome import Outcome, failed
from cogmap.experiments.ablation.variants import LABELS, OURS, PAPER, VARIANTS


def test_each_domain_has_a_panel_and_each_variant_a_row() -> None:
    domains = [Domain("town", "town", "m", []), Domain("cities", "cities", "km2", [])]
    kept = Outcome(1.0, 2.0, 4.0, is_lost=False)
    measured = {}
    for domain in domains:
        for variant in VARIANTS:
            measured[domain.name, variant] = [kept, kept]
    measured["town", PAPER] = [failed("lost"), kept]

    town, cities = figure(domains, measured).get_axes()

    assert [label.get_text() for label in town.get_yticklabels()] == [*LABELS.values()]
    assert town.get_title(loc="left") == "town"
    assert cities.get_xlabel() == "error, km²"
    assert [text.get_text() for text in town.texts] == ["1 without a number"]
    assert not cities.texts


def test_a_domain_without_any_number_is_drawn_too() -> None:
    domains = [Domain("loop", "loop", "m", [])]
    measured = {("loop", variant): [failed("lost")] for variant in VARIANTS}

    (axes,) = figure(domains, measured).get_axes()

    assert len(axes.texts) == len(VARIANTS)
    assert math.isnan(measured["loop", OURS][0].error)
