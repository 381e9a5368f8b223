"""The arrays and matrices that example messages hold."""

from __future__ import annotations

import numpy as np

from cogmap.schemas.array import Array, Matrix, MatrixType


def ramp(*shape: int, dtype: str) -> Array:
    """The numbers 0, 1, 2 … in that shape, scaled into [0, 1) where they are floats."""
    count = int(np.prod(shape))
    numbers = np.arange(count, dtype=np.float64)
    if dtype[1] == "f":
        numbers /= count

    values = numbers.astype(dtype)
    return Array.of(values.reshape(shape))


def matrix(rows: int, columns: int, dtype: MatrixType = "<f8") -> Matrix:
    """The numbers 0, 1/8, 2/8 … in rows."""
    numbers = np.arange(rows * columns, dtype=dtype)
    eighths = numbers / 8
    return Matrix.of(eighths.reshape(rows, columns), dtype)
