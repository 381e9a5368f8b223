"""The version of Cogmap, and of what it publishes and records."""

from __future__ import annotations

VERSION = "0.3.0"
