"""The mind of the participant: the workspace and the codelets that drive the town, as they are."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from cogmap.runtime.module import Module
from cogmap.schemas.graph import Decay, Snapshot
from cogmap.services import registry
from cogmap.services.codelets.rules import with_rules

# Distances err anew with each look here, so each counts (eq. 1); the room is small, and so are its
# places.
ROOM: dict[str, dict[str, Any]] = {
    "run": {"lockstep": True},
    "workspace": {"cell_m": 0.25},
    "codelets": {"landmarks": "points"},
}
WORKER = "codelets-1"
CYCLES_A_TRIAL = 1000
# All that a response depends on: none of the others changes where the agent and the posts are.
DECISIVE = (
    "localization",
    "object_place",
    "landmark",
    "path",
    "loop_detection",
    "map_correction",
    "apply_correction",
)


def sections(rules: str) -> dict[str, dict[str, Any]]:
    """Return the configuration of the mind, by a preset of rules."""
    return with_rules(ROOM, rules)


def modules(number: int, rules: str, only: Collection[str] = ()) -> list[Module]:
    """Build workspace and one worker for trial `number`, by a preset of rules, with `only` those
    codelets, or all.

    Codelets draw their samples by the number of the cycle. Each trial has cycles of its own, as if
    others had gone before: otherwise chance would be the same in all.
    """
    configured = sections(rules)
    workspace = registry.build("workspace", configured, "workspace", only)
    if number and workspace.restore is not None:
        workspace.restore(
            [
                Snapshot(
                    version=0,
                    cycle=number * CYCLES_A_TRIAL,
                    decay=Decay(),
                    nodes=[],
                    links=[],
                    tiles=[],
                )
            ]
        )
    return [workspace, registry.build("codelets", configured, WORKER, only)]
