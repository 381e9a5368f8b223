"""Arrays as they travel: `{dtype, shape, data}`, C order, little endian."""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np
import numpy.typing as npt

_ITEM_BYTES = {"|u1": 1, "<u2": 2, "<f2": 2, "<i4": 4, "<i8": 8, "<f4": 4, "<f8": 8}
DTYPES = frozenset(_ITEM_BYTES)
MatrixType = Literal["<f2", "<f4", "<f8"]
MAX_DIMENSIONS = 4


def _check(dtype: str, shape: tuple[int, ...], data: memoryview | bytes) -> None:
    """Raise ValueError if the parts of an array do not fit together, or it is not finite."""
    expected = _ITEM_BYTES.get(dtype, 0)
    if not expected:
        known = ", ".join(sorted(_ITEM_BYTES))
        raise ValueError(f"array dtype {dtype!r} is none of {known}")

    if len(shape) > MAX_DIMENSIONS or min(shape, default=0) < 0:
        raise ValueError(f"array shape {shape} is not one of up to {MAX_DIMENSIONS} sizes")

    for side in shape:
        expected *= side
    if len(data) != expected:
        raise ValueError(f"array of shape {shape} needs {expected} bytes, got {len(data)}")

    if dtype[1] == "f":
        is_finite = np.isfinite(np.frombuffer(data, dtype))
        if not np.logical_and.reduce(is_finite):
            raise ValueError("array holds NaN or infinity")


class Array(msgspec.Struct, frozen=True, eq=False, gc=False):
    """An n-dimensional array; floats in it are finite.

    `data` is a view of the buffer it was decoded from or made of: encoding copies it once, decoding
    never.
    """

    dtype: str
    shape: tuple[int, ...]
    data: memoryview

    def __post_init__(self) -> None:
        _check(self.dtype, self.shape, self.data)

    @classmethod
    def of(cls, values: npt.ArrayLike, dtype: str | None = None) -> Array:
        """Wrap `values`, without a copy if they are contiguous and of that dtype already."""
        array = np.ascontiguousarray(values, dtype)
        content = array.reshape(-1).view(np.uint8)
        return cls(array.dtype.str, array.shape, content.data)

    def numpy(self) -> npt.NDArray[np.generic]:
        """Return the values, read-only, sharing memory with the message."""
        array = np.frombuffer(self.data, self.dtype).reshape(self.shape)
        array.flags.writeable = False
        return array

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Array):
            return NotImplemented

        if self.dtype != other.dtype or self.shape != other.shape:
            return False
        return self.data == other.data

    def __hash__(self) -> int:
        content = bytes(self.data)
        return hash((self.dtype, self.shape, content))


class Matrix(msgspec.Struct, frozen=True, gc=False):
    """A matrix of floats that a node of the graph keeps; all are finite.

    It travels as an Array does, but owns its bytes: a node that is kept does not keep the message
    that it came in.
    """

    dtype: MatrixType
    shape: tuple[int, int]
    data: bytes

    def __post_init__(self) -> None:
        _check(self.dtype, self.shape, self.data)

    @classmethod
    def of(cls, values: npt.ArrayLike, dtype: MatrixType = "<f8") -> Matrix:
        """Copy `values`, (n, columns)."""
        array = np.ascontiguousarray(values, dtype)
        rows, columns = array.shape
        return cls(dtype, (rows, columns), array.tobytes())

    def numpy(self) -> npt.NDArray[np.float64]:
        """Return the values, read-only, sharing memory with the matrix, of its dtype."""
        values = np.frombuffer(self.data, self.dtype)
        return values.reshape(self.shape)
