"""The towns that there are to drive in. Pure, but for the extract that one is read from."""

from __future__ import annotations

from services.sim.layout.blocks import town as blocks
from services.sim.layout.place import Place
from services.sim.layout.town import generate

LOOP = "loop"
BLOCKS = "blocks"


def place(town: str, seed: int, size_m: float) -> Place:
    """The town of that name, LOOP or BLOCKS, from `seed`; `size_m` is the side of one of blocks."""
    if town == LOOP:
        return generate(seed)

    return blocks.generate(seed, size_m)
