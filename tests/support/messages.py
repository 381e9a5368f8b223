"""Choosing among messages."""

from __future__ import annotations

from cogmap.testing import of_type

__all__ = ["of_type"]
