"""The settings of procedural memory."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from schemas.base import Share


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What the agent can do, and when it comes to mind."""

    mode: Annotated[
        Literal["lockstep", "real_time"],
        msgspec.Meta(
            description="lockstep: a broadcast waits for all that its behaviours depend on. "
            "real_time: it does not."
        ),
    ] = "real_time"
    schemes: Annotated[
        str,
        msgspec.Meta(
            description="TOML file of schemes, in the place of the built-in ones where it is not "
            "empty."
        ),
    ] = ""
    instantiation: Annotated[
        Share,
        msgspec.Meta(
            description="Activation at which a scheme becomes a behaviour that competes, 0 to 1."
        ),
    ] = 0.1
    unconscious_share: Annotated[
        Share,
        msgspec.Meta(
            description="Share of their activation with which such nodes count that are in the "
            "graph and not in the broadcast, 0 to 1: what is conscious comes first."
        ),
    ] = 0.5
    graph_kinds: Annotated[
        list[str],
        msgspec.Meta(
            description="Kinds of nodes that belong to every situation, as they are in the graph, "
            "also where the broadcast has none of them."
        ),
    ] = msgspec.field(default_factory=lambda: ["goal", "plan"])
