"""Packages that some benchmarks compare with or measure by, and running Cogmap does not need."""

from __future__ import annotations

from typing import Any

from cogmap.errors import UsageError

REMEDY = "is not installed, and this benchmark needs it: run make bench-setup"


def gtsam() -> Any:
    """The package gtsam, which has no types. Raises UsageError where it is not installed."""
    try:
        import gtsam
    except ImportError:
        raise UsageError(f"gtsam {REMEDY}") from None

    return gtsam
