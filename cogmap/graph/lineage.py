"""The lineage of a graph: a digest of all commits that it was made by. Pure."""

from __future__ import annotations

import hashlib

from msgspec.structs import replace

from cogmap.bus.codec import encode
from cogmap.schemas.graph import Delta

FIRST = "0"
"""The lineage of a graph to which nothing was committed."""

_SIZE_BYTES = 8


def after(lineage: str, delta: Delta) -> str:
    """Return the lineage of a graph of `lineage` to which `delta` is committed.

    A graph depends on its commits alone, so two of one lineage are equal. The delta counts as it
    was before it was given its source and number.
    """
    content = encode(replace(delta, source="", seq=0))
    return hashlib.blake2b(content, digest_size=_SIZE_BYTES, key=lineage.encode()).hexdigest()
