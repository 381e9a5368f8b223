"""The metrics of the ablation as one flat object."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, median, stdev

import numpy as np

from cogmap.experiments.ablation.measure import ERROR, Domain, Measured
from cogmap.experiments.ablation.outcome import Outcome
from cogmap.experiments.ablation.variants import OURS, VARIANTS

# Metres or square kilometres; None where no run gave a number.
Metrics = dict[str, float | str | None]


def ablation_metrics(domains: Sequence[Domain], measured: Measured) -> Metrics:
    """Return mean, SD and median of every cell, the runs that were lost, and ratios: of errors, or
    of what else a domain measures.

    `..._over_fused` is of the same run's fused self-motion alone, where that has the errors that
    are compared, `..._over_ours_...` of the run of the same case by our rules. A cell is filled if
    each of its runs has a number or is counted as lost; `..._without_number` counts those that
    ended early.
    """
    metrics: Metrics = {}
    filled = 0

    for domain in domains:
        ours = measured[domain.name, OURS]
        for variant in VARIANTS:
            outcomes = measured[domain.name, variant]
            filled += all(np.isfinite(each.error) or each.is_lost for each in outcomes)
            metrics |= _cell(f"{domain.name}_{variant}", domain, outcomes)
            if variant != OURS:
                metrics |= spread(f"{variant}_over_ours_{domain.name}", over(outcomes, ours))

    cells = len(domains) * len(VARIANTS)
    return metrics | {"cells": float(cells), "cells_filled": float(filled)}


def _cell(name: str, domain: Domain, outcomes: Sequence[Outcome]) -> Metrics:
    measured = f"{domain.quantity}_{domain.unit}"
    metrics: Metrics = {}
    metrics |= spread(f"{name}_{measured}", [each.error for each in outcomes])
    if domain.quantity == ERROR:
        metrics |= spread(f"{name}_fused_{measured}", [each.fused for each in outcomes])
        metrics |= spread(f"{name}_wheels_{measured}", [each.wheels for each in outcomes])
        metrics |= spread(f"{name}_over_fused", [each.over_fused for each in outcomes])

    failures = [each.failure for each in outcomes if each.failure]
    metrics[f"{name}_runs"] = float(len(outcomes))
    metrics[f"{name}_lost"] = float(sum(each.is_lost for each in outcomes))
    metrics[f"{name}_without_number"] = float(len(failures))
    if failures:
        metrics[f"{name}_failure"] = failures[0]
    return metrics


def over(outcomes: Sequence[Outcome], others: Sequence[Outcome]) -> list[float]:
    """Return the ratio of the errors of each case, NaN where one of them has none."""
    ratios = []

    for outcome, other in zip(outcomes, others, strict=True):
        ratios.append(outcome.error / other.error if other.error > 0 else float("nan"))

    return ratios


def spread(name: str, values: Sequence[float]) -> Metrics:
    """Return `name`_mean, `name`_sd and `name`_median of the values that are numbers: None of none,
    and the SD of one.
    """
    known = [value for value in values if np.isfinite(value)]
    return {
        f"{name}_mean": fmean(known) if known else None,
        f"{name}_sd": stdev(known) if len(known) > 1 else None,
        f"{name}_median": median(known) if known else None,
    }
