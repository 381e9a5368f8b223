"""Silence for libraries that print from C."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from cogmap.errors import UsageError
from cogmap.services.sim.config import NEEDS_PYBULLET


@contextmanager
def quiet() -> Iterator[None]:
    """Send file descriptors 1 and 2 nowhere for the time being."""
    sys.stdout.flush()
    sys.stderr.flush()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    kept = (os.dup(1), os.dup(2))
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        for kept_fd, fd in zip(kept, (1, 2), strict=True):
            os.dup2(kept_fd, fd)
            os.close(kept_fd)
        os.close(nowhere)


try:
    with quiet():  # pybullet greets on standard error while it is imported
        import pybullet
except ModuleNotFoundError:
    raise UsageError(NEEDS_PYBULLET) from None

__all__ = ["pybullet", "quiet"]
