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
            "published memory, of vectors of 1000 bits. LIDA: binary; here modular, because of 50 "
            "episodes binary memory recalls 40 %, and modular memory of 500 recalls 96 %."
        ),
    ] = "modular"
    hard_locations: Annotated[
        int,
        msgspec.Meta(ge=1000, le=100_000, description="Hard locations, 1000 to 100000."),
    ] = 10_000
    dimensions: Annotated[
        int,
        msgspec.Meta(
            ge=64,
            le=8192,
            description="Dimensions of a modular memory's vectors, 64 to 8192.",
        ),
    ] = 1024
    activated_share: Annotated[
        float,
        msgspec.Meta(
            ge=0.01,
            le=0.5,
            description="Share of a modular memory's hard locations that a cue activates, 0.01 to "
            "0.5. LIDA: 0.001, by a radius of 451 of 1000 bits; here 0.07, because the nearest of "
            "them count most: of 500 maps, each stored once, cues with 30 % of their dimensions "
            "corrupted recall all, and with 0.01 89 %.",
        ),
    ] = 0.07
    max_reads: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="Reads after which an iterated read ends, converged or not, 1 to 1000.",
        ),
    ] = 19
    seed: Annotated[
        int,
        msgspec.Meta(
            ge=0,
            le=2**62,
            description="Seed of the addresses of the hard locations, 0 to 2**62.",
        ),
    ] = 0
