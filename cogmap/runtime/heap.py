"""How the C library treats memory that a process has freed."""

from __future__ import annotations

import ctypes

# Twice what sensory memory frees with each frame; glibc takes no larger threshold of mmap.
KEPT_BYTES = 32 * 2**20
# From glibc's malloc.h.
_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3


def keep_freed_memory() -> None:
    """Keep up to KEPT_BYTES that were freed, for the next arrays of this process.

    By itself glibc returns the arrays of one camera frame to the kernel, which then clears some
    4,000 pages for those of the next. Other C libraries stay as they are.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return

    mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
    mallopt(_M_MMAP_THRESHOLD, KEPT_BYTES)
