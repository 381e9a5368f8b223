"""The settings of action selection: LIDA's published defaults, unless one says otherwise."""

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
            "that one is chosen too because it leads to another. most_active: the "
            "most active one is chosen. The net is the default, being LIDA's: by the "
            "built-in schemes the robot drives the same with both."
        ),
    ] = "behaviour_net"
    selection_threshold: Annotated[
        Share, msgspec.Meta(description="Activation that a behaviour needs to be chosen.")
    ] = 0.9
    threshold_fall: Annotated[
        Share,
        msgspec.Meta(description="Fall of that threshold with each attempt that chooses none."),
    ] = 0.1
