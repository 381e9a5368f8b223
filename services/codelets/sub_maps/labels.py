"""Labels that clusters keep as the partition changes."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from cogmap.geometry.arrays import Indices

NEW = -1


def kept_labels(before: Indices, after: Indices, next_label: int) -> Indices:
    """(n,): the partition `after` with the labels of `before`, NEW of objects that had none.

    Each cluster keeps the label of the one that it shares most objects with; of several that claim
    one label, and of several labels for one cluster, the most objects in all decide. Clusters that
    are left over get new labels from `next_label`, in the order of their first objects.
    """
    names, number = np.unique(after, return_inverse=True)
    had_label = before != NEW
    old_names, old_number = np.unique(before[had_label], return_inverse=True)

    shared = np.zeros((len(names), len(old_names)))
    np.add.at(shared, (number[had_label], old_number), 1.0)
    clusters, olds = linear_sum_assignment(shared, maximize=True)
    is_shared = shared[clusters, olds] > 0

    labels = np.full(len(names), NEW)
    labels[clusters[is_shared]] = old_names[olds[is_shared]]

    _, first = np.unique(after, return_index=True)
    fresh = np.flatnonzero(labels == NEW)
    fresh = fresh[np.argsort(first[fresh])]
    labels[fresh] = next_label + np.arange(len(fresh))
    kept: Indices = labels[number]
    return kept
