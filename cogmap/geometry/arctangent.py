"""The arctangent of many single-precision numbers at once.

NumPy computes its own one by one where the processor lacks AVX-512, in five times the time, and by
another method where it has it, so that two machines disagree in the last digit.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from cogmap.geometry.arrays import Floats, Singles

DEGREE = 6
TINY = np.float32(1e-30)
QUARTER_TURN_RAD = np.float32(np.pi / 2)
EIGHTH_TURN_RAD = np.float32(np.pi / 4)
SIGN_BIT = np.uint32(1 << 31)


def _arctan_over_ratio(squared: Floats) -> Floats:
    """arctan(r) / r for r² > 0."""
    ratio = np.sqrt(squared)
    over: Floats = np.arctan(ratio) / ratio
    return over


def _coefficients() -> list[np.float32]:
    """Of the polynomial in r² that is arctan(r) / r for r from 0 to 1, the highest power first."""
    fitted = Chebyshev.interpolate(_arctan_over_ratio, DEGREE, domain=[0.0, 1.0])
    powers = fitted.convert(kind=Polynomial)
    return list(powers.coef[::-1].astype(np.float32))


COEFFICIENTS = _coefficients()


def arctan2(y: Singles, x: Singles) -> Singles:
    """The angles of vectors (x, y) in (-pi, pi], any shape; the error is at most 1e-6 rad."""
    distance_x = np.abs(x)
    distance_y = np.abs(y)
    larger = np.maximum(distance_x, distance_y)
    np.maximum(larger, TINY, out=larger)
    ratio = np.minimum(distance_x, distance_y)
    ratio /= larger

    squared = np.multiply(ratio, ratio, out=larger)
    angle_rad = COEFFICIENTS[0] * squared
    for coefficient in COEFFICIENTS[1:-1]:
        angle_rad += coefficient
        angle_rad *= squared
    angle_rad += COEFFICIENTS[-1]
    angle_rad *= ratio

    _mirror(angle_rad, EIGHTH_TURN_RAD, distance_x - distance_y)
    _mirror(angle_rad, QUARTER_TURN_RAD, x)
    _copy_signs(y, angle_rad)
    return angle_rad


def _mirror(angle_rad: Singles, axis_rad: np.float32, side: Singles) -> None:
    """Mirror angles in place at an axis, where `side` is negative; none is beyond the axis."""
    np.subtract(axis_rad, angle_rad, out=angle_rad)
    _copy_signs(side, angle_rad)
    np.subtract(axis_rad, angle_rad, out=angle_rad)


def _copy_signs(signed: Singles, positive: Singles) -> None:
    """Give the signs of some numbers to others; np.copysign does so one by one."""
    bits = positive.view(np.uint32)
    bits |= signed.view(np.uint32) & SIGN_BIT
