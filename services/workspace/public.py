"""What others may use of the workspace: its ledger."""

from __future__ import annotations

from cogmap.services.workspace.commit import Ledger

__all__ = ["Ledger"]
