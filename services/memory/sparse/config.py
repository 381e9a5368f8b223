"""The settings of the sparse distributed memory."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec


class SparseConfig(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Hard locations and their reach. A modular memory has 4 bytes of counters for each dimension
    of each hard location: 41 MB with the defaults, and 10 MB of addresses.
    """

    kind: Annotated[
        Literal["modular", "binary"],
        msgspec.Meta(
            description="modular: vectors of `dimensions` values, 0 to 15. binary: LIDA's "
            "published memory, of vectors of 1000 bits. LIDA: binary; here modular, "
            "because of 50 episodes binary memory recalls 40 %, and modular memory of "
            "500 recalls 96 %."
        ),
    ] = "modular"
    hard_locations: Annotated[
        int,
        msgspec.Meta(ge=1000, le=100_000, description="Hard locations."),
    ] = 10_000
    dimensions: Annotated[
        int,
        msgspec.Meta(
            ge=64,
            le=8192,
            description="Dimensions of a modular memory's vectors.",
        ),
    ] = 1024
    seed: Annotated[
        int,
        msgspec.Meta(
            ge=0,
            le=2**62,
            description="Seed of the addresses of the hard locations.",
        ),
    ] = 0
