"""Records what travels on the bus, and reads it back: `open_log` is where to begin."""

from __future__ import annotations

from cogmap.recording.log import Entry, Log, open_log

__all__ = ["Entry", "Log", "open_log"]
