"""The settings of procedural memory."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import Share


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What the agent can do, and when it comes to mind."""

    schemes: Annotated[
        str,
        msgspec.Meta(
            description="TOML file of schemes, in the place of the built-in ones; empty: those."
        ),
    ] = ""
    instantiation: Annotated[
        Share,
        msgspec.Meta(description="Activation at which a scheme becomes a behaviour that competes."),
    ] = 0.1
    unconscious_share: Annotated[
        Share,
        msgspec.Meta(
            description="Share of their activation with which such nodes count that are in the "
            "graph and not in the broadcast: what is conscious comes first. LIDA: 0, "
            "schemes are activated by the broadcast alone; here 0.5, because a broadcast has the "
            "content of one codelet: the plan that an action follows is seldom in it."
        ),
    ] = 0.5
    max_guidance_schemes: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Guidance schemes that are kept of those learned; the oldest are "
            "forgotten.",
        ),
    ] = 1000
    graph_kinds: Annotated[
        list[str],
        msgspec.Meta(
            description="Kinds of nodes that belong to every situation, as they are in the graph, "
            "also if the broadcast has none of them. LIDA: none; here goals and plans, because "
            "they are brought once a second, and an action is chosen after each broadcast."
        ),
    ] = msgspec.field(default_factory=lambda: ["goal", "plan"])
