"""The workspace as a module."""

from __future__ import annotations

from collections.abc import Sequence

from cogmap.errors import ConfigError
from cogmap.runtime.codelet import ConfiguredCodelet
from cogmap.runtime.module import Module
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.services.workspace.config import Config
from cogmap.services.workspace.cycle import WORKERS, Workspace

__all__ = ["Config", "Workspace", "build"]


def build(
    config: Config,
    instance: str,
    codelets: Sequence[ConfiguredCodelet],
    run: Run = REAL_TIME,
) -> Module:
    """Build the module `workspace`, the single writer of the graph, which calls `codelets`. Raises
    ConfigError if two goals have one name.
    """
    names = [goal.name for goal in config.goals]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(
                f"[workspace] goals: two are named {name!r}: give each a name of its own"
            )

    workspace = Workspace(config, codelets, run)

    published = (
        topics.DELTA,
        topics.TASK,
        topics.LEASES,
        topics.COALITIONS,
        topics.REPLAY,
        topics.ROUTE_REPLAY,
    )
    return (
        Module("workspace", instance, emits={topics.PRESENCE}, notes=workspace.notes)
        .on(topics.SELF_MOTION, workspace.on_motion, emits=published)
        .on(topics.SCAN, workspace.on_scan, emits=published)
        .on(topics.ENERGY, workspace.on_energy, emits=published)
        .on(topics.PERCEPTS, workspace.on_percepts, emits=published)
        .on(topics.PROPOSAL, workspace.on_proposal, emits=published)
        .on(topics.OFFER, workspace.on_offer, emits=published)
        .on(topics.COMPETITION, workspace.on_competition, emits=published)
        .on(topics.BROADCAST, workspace.on_broadcast, emits=published)
        .observing(workspace.on_presence, heartbeats=[WORKERS], emits=published)
        .on(topics.CLOCK, workspace.on_clock, emits=published)
        .serve(topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, workspace.snapshot)
        .journaling(
            topics.DELTA,
            workspace.restore,
            workspace.snapshot,
            backfill=[topics.SELF_MOTION, topics.OFFER, topics.COMPETITION, topics.BROADCAST],
        )
    )
