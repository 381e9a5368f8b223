"""The `cogmap` command."""

from __future__ import annotations

import time

BEGAN_S = time.monotonic()
"""When the command began, on the monotonic clock: before all else was imported."""
