"""Arrays as they travel: `{dtype, shape, data}`, C order, little endian."""

from __future__ import annotations

import msgspec
import numpy as np
import numpy.typing as npt

_ITEM_BYTES = {"|u1": 1, "<u2": 2, "<i4": 4, "<i8": 8, "<f4": 4, "<f8": 8}
DTYPES = frozenset(_ITEM_BYTES)
MAX_DIMENSIONS = 4


class Array(msgspec.Struct, frozen=True, eq=False, gc=False):
    """An n-dimensional array; floats in it are finite.

    `data` is a view of the buffer it was decoded from or made of: encoding copies it once, decoding
    never.
    """

    dtype: str
    shape: tuple[int, ...]
    data: memoryview

    def __post_init__(self) -> None:
        expected = _ITEM_BYTES.get(self.dtype, 0)
        if not expected:
            raise ValueError(
                f"array dtype {self.dtype!r} is none of {', '.join(sorted(_ITEM_BYTES))}"
            )
        for side in self.shape:
            expected *= side if side >= 0 else 0
        if len(self.shape) > MAX_DIMENSIONS or min(self.shape, default=0) < 0:
            raise ValueError(f"array shape {self.shape} is not one of up to {MAX_DIMENSIONS} sizes")
        if len(self.data) != expected:
            raise ValueError(
                f"array of shape {self.shape} needs {expected} bytes, got {len(self.data)}"
            )
        if self.dtype[1] == "f" and not np.isfinite(np.frombuffer(self.data, self.dtype)).all():
            raise ValueError("array holds NaN or infinity")

    @classmethod
    def of(cls, values: npt.ArrayLike, dtype: str | None = None) -> Array:
        """Wrap `values`, without a copy where they are contiguous and of that dtype already."""
        array = np.ascontiguousarray(values, dtype)
        return cls(array.dtype.str, array.shape, array.reshape(-1).view(np.uint8).data)

    def numpy(self) -> npt.NDArray[np.generic]:
        """The values, read-only, sharing memory with the message."""
        array = np.frombuffer(self.data, self.dtype).reshape(self.shape)
        array.flags.writeable = False
        return array

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Array):
            return NotImplemented
        return (self.dtype, self.shape) == (other.dtype, other.shape) and self.data == other.data

    def __hash__(self) -> int:
        return hash((self.dtype, self.shape, bytes(self.data)))
