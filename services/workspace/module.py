"""The workspace as a module."""

from __future__ import annotations

from cogmap.runtime.module import Module
from schemas import topics
from services.workspace.config import Config
from services.workspace.cycle import Workspace

__all__ = ["Config", "Workspace", "build"]


def build(config: Config, instance: str) -> Module:
    """The module `workspace`, the single writer of the graph."""
    workspace = Workspace(config)
    says = (topics.DELTA, topics.TASK)
    return (
        Module("workspace", instance, emits={topics.PRESENCE})
        .on(topics.SELF_MOTION, workspace.on_motion, emits=says)
        .on(topics.PERCEPTS, workspace.on_percepts, emits=says)
        .on(topics.PROPOSAL, workspace.on_proposal, emits=says)
        .on(topics.PRESENCE, workspace.on_presence, emits=says)
        .on(topics.CLOCK, workspace.on_clock, emits=says)
        .serve(topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, workspace.snapshot)
        .journaling(
            topics.DELTA, workspace.restore, workspace.snapshot, backfill=[topics.SELF_MOTION]
        )
    )
