"""How uncertain the steps of the path are."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import PathColumn
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.path import steps_of

SETTINGS = Config()
OF_CAMERAS_M2 = 2e-4
OF_CAMERAS_RAD2 = 2e-7
"""What self-motion by cameras states to err by in a metre straight ahead."""


def metres_ahead(count: int, variance_m2: float, variance_rad2: float) -> Floats:
    """Rows of a path straight ahead whose self-motion states that it errs so in each metre."""
    rows = np.zeros((count + 1, len(PathColumn)))
    metres = np.arange(count + 1.0)
    rows[:, PathColumn.STAMP_S] = metres
    rows[:, PathColumn.ODOMETRY_X_M] = metres
    rows[:, PathColumn.VARIANCE_M2] = metres * variance_m2
    rows[:, PathColumn.VARIANCE_RAD2] = metres * variance_rad2
    return rows


def test_a_step_by_cameras_is_as_uncertain_as_self_motion_states() -> None:
    rows = metres_ahead(3, OF_CAMERAS_M2, OF_CAMERAS_RAD2)

    information = steps_of(rows, SETTINGS).information
    variances = 1 / np.diagonal(information, axis1=1, axis2=2)
    assert variances == pytest.approx(
        np.tile([OF_CAMERAS_M2, OF_CAMERAS_M2, OF_CAMERAS_RAD2], (3, 1))
    )


def test_a_step_that_states_no_error_is_as_uncertain_as_the_settings_have_it_at_least() -> None:
    rows = metres_ahead(3, 0.0, 0.0)

    information = steps_of(rows, SETTINGS).information
    variances = 1 / np.diagonal(information, axis1=1, axis2=2)
    least_m2 = SETTINGS.path_variance_per_m
    assert variances == pytest.approx(
        np.tile([least_m2, least_m2, SETTINGS.heading_variance_per_m], (3, 1))
    )
