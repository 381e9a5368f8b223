"""What others may use of the workspace: its ledger, and how sure a percept must be."""

from __future__ import annotations

from cogmap.services.workspace.commit import Ledger
from cogmap.services.workspace.ingress import RECOGNITION_THRESHOLD

__all__ = ["RECOGNITION_THRESHOLD", "Ledger"]
