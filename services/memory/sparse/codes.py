"""Vectors as bits whose Hamming distance is theirs, packed for a fast search over many. Pure."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse.vectors import VALUES

Counts = npt.NDArray[np.int32]
BITS = VALUES // 2


def johnson_codes(vectors: Bytes) -> Bytes:
    """Encode each of (n, dimensions) modular vectors in the Johnson code, (n, dimensions).

    From one value to the next around the circle one bit changes, so that as many bits differ
    between two values as there are steps between them, the shorter way around.
    """
    return JOHNSON[vectors]


def bit_codes(vectors: Bytes) -> Bytes:
    """Encode each of (n, dimensions) binary vectors with a bit a dimension, (n, bytes)."""
    return np.packbits(vectors, axis=-1)


def hamming(rows: Bytes, row: Bytes) -> Counts:
    """Count the bits in which each of (n, bytes) differs from (bytes,), (n,)."""
    # With `row` as the only neighbour, OpenCV's search is one pass over the rows.
    nearest, _ = cv2.batchDistance(rows, row[None], cv2.CV_32S, normType=cv2.NORM_HAMMING, K=1)
    return np.asarray(nearest[:, 0], np.int32)


def _johnson() -> Bytes:
    """Make the code of each value: ones enter from the left up to half-way round, then zeros do."""
    value = np.arange(VALUES)[:, None]
    bit = np.arange(BITS)[None, :]
    entered = bit < value
    replaced = bit < value - BITS
    return np.packbits(entered & ~replaced, axis=1)[:, 0]


JOHNSON = _johnson()
