"""What others may use of procedural memory: how guidance schemes are written as TOML."""

from __future__ import annotations

from cogmap.services.procedural.guidance import toml

__all__ = ["toml"]
