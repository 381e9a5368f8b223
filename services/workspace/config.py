"""How the workspace is configured."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import Finite, Name, Unit

Milliseconds = Annotated[float, msgspec.Meta(gt=0, le=3.6e6)]


class GivenGoal(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A goal that the agent has from its start."""

    name: Annotated[Name, msgspec.Meta(description="What it is called; no two have one name.")]
    object: Annotated[
        str,
        msgspec.Meta(description="Label of the object to go to; empty for a position."),
    ] = ""
    x_m: Annotated[
        Finite, msgspec.Meta(description="Position ahead of where the agent starts, m.")
    ] = 0.0
    y_m: Annotated[
        Finite, msgspec.Meta(description="Position left of where the agent starts, m.")
    ] = 0.0


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The cycle's timing, the resolution of the map, and how activation decays."""

    cell_m: Annotated[
        float,
        msgspec.Meta(
            gt=0,
            le=1e4,
            description="Distance between neighbouring place nodes of the root map, m.",
        ),
    ] = 1.0
    deadline_ms: Annotated[
        Milliseconds,
        msgspec.Meta(
            description="In real time, the age of the view at which a cycle ends, ms: later where "
            "answers usually take longer."
        ),
    ] = 180.0
    longest_deadline_ms: Annotated[
        Milliseconds,
        msgspec.Meta(
            description="In real time, the age of the view up to which a cycle waits for answers "
            "that usually take long, as over a slow link, ms."
        ),
    ] = 1000.0
    lease_ms: Annotated[
        Milliseconds,
        msgspec.Meta(
            description="In real time, how long a worker may take for a task before another gets "
            "it, ms: longer where all usually take longer."
        ),
    ] = 120.0
    decay: Annotated[
        Unit,
        msgspec.Meta(
            description="What a node's activation loses in a cycle. LIDA: 0.1 in a tick; here in "
            "a cycle of 40, because percepts and codelets excite nodes once in each: "
            "by the tick nothing would last from one view to the next."
        ),
    ] = 0.1
    base_level_decay: Annotated[
        Unit,
        msgspec.Meta(
            description="What a node's base level loses in a cycle. LIDA: 0.1 in a tick, of "
            "current activation; here so little, because a base level is memory: what "
            "one broadcast adds lasts for 40 s."
        ),
    ] = 0.0005
    background_cycles: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="In lockstep, cycles after which a background codelet's answer is "
            "committed.",
        ),
    ] = 3
    goals: Annotated[
        list[GivenGoal], msgspec.Meta(description="Goals that the agent is given.")
    ] = []
    goals_after_s: Annotated[
        float,
        msgspec.Meta(
            ge=0,
            le=1e6,
            description="Time from which on it has them, in s; 0: from its start.",
        ),
    ] = 0.0
    in_order: Annotated[
        bool,
        msgspec.Meta(
            description="Whether each of these goals counts once the one before is reached; if "
            "not, the agent decides their order."
        ),
    ] = False
