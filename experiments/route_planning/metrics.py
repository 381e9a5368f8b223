"""The metrics of the experiment as one flat object. Shares are of the shortest tour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.experiments.route_planning import published
from cogmap.experiments.route_planning.measure import Planned
from cogmap.geometry.arrays import Floats

MIN_PROBLEMS = 3
# How tours are planned: see Planned.
PLANNED = ("hierarchical", "straightened", "flat")
Metrics = dict[str, float]


def human_metrics(problems: Sequence[Planned]) -> Metrics:
    """Return metrics of the problems that people drew tours of: each, and how far the model agrees
    with people.

    `within_iqr_share_in_sample` is the share of problems on which the median of the model's
    participants lies within people's quartiles; what is assumed of them was chosen on problems of
    people. Correlations are over the problems, of mean with mean.
    """
    if not problems:
        return {}

    people = _means([problem.people for problem in problems])
    is_within = [problem.is_within_quartiles for problem in problems]
    metrics: Metrics = {
        "human_problems": float(len(problems)),
        "within_iqr_share_in_sample": float(np.mean(is_within)),
        "human_people_above_optimum": float(people.mean()),
    }

    for name in PLANNED:
        means = _means([getattr(problem, name) for problem in problems])
        metrics[f"human_{name}_above_optimum"] = float(means.mean())
        metrics[f"{name}_correlation_with_people"] = correlation(means, people)

    for problem in problems:
        prefix = problem.name.lower()
        low, high = problem.people_quartiles
        metrics |= {
            f"{prefix}_goals": float(problem.goals),
            f"{prefix}_people": float(len(problem.people)),
            f"{prefix}_people_above_optimum_median": float(np.median(problem.people)),
            f"{prefix}_people_above_optimum_quartile_1": low,
            f"{prefix}_people_above_optimum_quartile_3": high,
            f"{prefix}_hierarchical_above_optimum_median": float(np.median(problem.hierarchical)),
            f"{prefix}_straightened_above_optimum_median": float(np.median(problem.straightened)),
            f"{prefix}_flat_above_optimum_median": float(np.median(problem.flat)),
        }
    return metrics


def drawn_metrics(problems: Sequence[Planned]) -> Metrics:
    """Return means over the drawn problems of each size, beside what is published of people.

    Published problems are others, of the same numbers of goals.
    """
    metrics: Metrics = {}

    for goals in sorted({problem.goals for problem in problems}):
        prefix = f"goals_{goals:03d}"
        same = [problem for problem in problems if problem.goals == goals]
        for name in PLANNED:
            means = _means([getattr(problem, name) for problem in same])
            metrics[f"{prefix}_{name}_above_optimum"] = float(means.mean())

        if goals in published.HUMAN_PERCENT:
            metrics[f"{prefix}_published_people"] = published.HUMAN_PERCENT[goals] / 100
            metrics[f"{prefix}_published_model"] = published.MODEL_PERCENT[goals] / 100
        if goals in published.DRAWN_HUMAN:
            metrics[f"{prefix}_published_people"] = published.DRAWN_HUMAN[goals]

    return metrics


def correlation(first: Floats, second: Floats) -> float:
    """Return Pearson's correlation, 0 if there are too few, or one does not vary."""
    is_constant = np.ptp(first) == 0 or np.ptp(second) == 0
    if len(first) < MIN_PROBLEMS or is_constant:
        return 0.0

    matrix = np.corrcoef(first, second)
    return float(matrix[0, 1])


def _means(values: Sequence[Floats]) -> Floats:
    """Return the mean of each, (n,)."""
    means = [each.mean() for each in values]
    return np.array(means)
