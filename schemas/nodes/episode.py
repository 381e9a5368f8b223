"""An episode recalled from long-term memory (beyond the paper, which leaves that open)."""

from __future__ import annotations

from cogmap.schemas.base import Count, Finite, Name, Part
from cogmap.schemas.nodes.base import GraphNode, Salience
from cogmap.schemas.nodes.ids import ROOT_MAP


class Remembered(Part, kw_only=True, frozen=True):
    """A node that was conscious in an episode: its kind, its name, and the feeling attached to it.

    The name of an object is that of its look: individuals are numbered anew in each run.
    """

    kind: Name
    label: Name
    salience: Salience = 0.0


class Episode(GraphNode, kw_only=True, frozen=True, tag="episode"):
    """What was conscious at a place, recalled where the agent is reminded of it.

    `activation` is at first the share in which it matches what is conscious here. Its place is
    (`x_m`, `y_m`) of the map `map`; it lasted from `from_ns` to `until_ns` of the run `run`, the
    first being 1. `number` is what long-term memory calls it.
    """

    number: Count
    run: Count
    map: Name = ROOT_MAP
    x_m: Finite
    y_m: Finite
    from_ns: Count
    until_ns: Count
    content: list[Remembered]
