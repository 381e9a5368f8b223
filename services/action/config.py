"""The settings of action selection: LIDA's published defaults, where none says otherwise."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from cogmap.schemas.base import Share


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How one behaviour is chosen."""

    selector: Annotated[
        Literal["behaviour_net", "most_active"],
        msgspec.Meta(
            description="behaviour_net: behaviours pass activation to each other (Maes 1989), so "
            "that one is chosen too because it leads to another. most_active: the most active one "
            "is chosen. The net is the default, being LIDA's: by the built-in schemes the robot "
            "drives the same with both."
        ),
    ] = "behaviour_net"
    selection_threshold: Annotated[
        Share, msgspec.Meta(description="Activation that a behaviour needs to be chosen, 0 to 1.")
    ] = 0.9
    threshold_fall: Annotated[
        Share,
        msgspec.Meta(
            description="Fall of that threshold with each attempt that chooses none, 0 to 1."
        ),
    ] = 0.1
    broadcast_excitation: Annotated[
        Share,
        msgspec.Meta(
            description="Share of the activation of its context that a behaviour gathers from a "
            "broadcast, 0 to 1."
        ),
    ] = 0.05
    successor_excitation: Annotated[
        Share,
        msgspec.Meta(
            description="Share of its activation that a behaviour passes to those for which its "
            "results are the missing part of the context, 0 to 1."
        ),
    ] = 0.04
    predecessor_excitation: Annotated[
        Share,
        msgspec.Meta(
            description="Share of its activation that a behaviour whose context is missing passes "
            "to those that bring it about, 0 to 1."
        ),
    ] = 0.1
    conflictor_inhibition: Annotated[
        Share,
        msgspec.Meta(
            description="Share of its activation by which a behaviour inhibits those that undo its "
            "context, 0 to 1."
        ),
    ] = 0.04
    net_decay: Annotated[
        Share,
        msgspec.Meta(
            description="What a behaviour loses with each broadcast of the activation that it has "
            "gathered in the net, 0 to 1. LIDA: 0.1 in a tick; here with each broadcast, because "
            "behaviours gather once in each: by the tick nothing would last to the next."
        ),
    ] = 0.1
