"""How the workspace is configured."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from cogmap.schemas.base import Finite, Name, Unit

Milliseconds = Annotated[float, msgspec.Meta(gt=0, le=3.6e6)]


class GivenGoal(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A goal that the agent has from its start."""

    name: Annotated[Name, msgspec.Meta(description="What it is called; no two have one name")]
    object: Annotated[
        str,
        msgspec.Meta(description="Label of the object to go to; empty for a position"),
    ] = ""
    x_m: Annotated[
        Finite, msgspec.Meta(description="Position ahead of where the agent starts, m")
    ] = 0.0
    y_m: Annotated[
        Finite, msgspec.Meta(description="Position left of where the agent starts, m")
    ] = 0.0


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The cycle's timing, the resolution of the map, and how activation decays."""

    cell_m: Annotated[
        float,
        msgspec.Meta(
            gt=0, le=1e4, description="Distance between neighbouring place nodes of the root map, m"
        ),
    ] = 1.0
    deadline_ms: Annotated[
        Milliseconds,
        msgspec.Meta(description="In real time, the age of the view at which a cycle ends, ms"),
    ] = 180.0
    max_scan_age_ms: Annotated[
        Milliseconds,
        msgspec.Meta(
            description="In real time, how much older than its view a range scan may be, ms; an"
            " older one is not used"
        ),
    ] = 100.0
    lease_ms: Annotated[
        Milliseconds,
        msgspec.Meta(
            description="In real time, how long a worker may take for a task before another gets"
            " it, ms"
        ),
    ] = 120.0
    attempts: Annotated[
        int,
        msgspec.Meta(ge=1, le=100, description="Workers that a task is given to before it fails"),
    ] = 5
    first_samples: Annotated[
        int,
        msgspec.Meta(
            ge=10, le=100_000, description="Samples of the self before anything is known, number"
        ),
    ] = 200
    recognition_threshold: Annotated[
        Unit,
        msgspec.Meta(
            description="A percept enters the workspace where its evidence is above this, 0 to 1."
            " LIDA: 0.7 of total activation; here of evidence, because the map is to be learned"
            " from what a view says, and not from what was expected of it"
        ),
    ] = 0.7
    decay: Annotated[
        Unit,
        msgspec.Meta(
            description="What a node's activation loses in a cycle, 0 to 1. LIDA: 0.1 in a tick;"
            " here in a cycle of 40, because percepts and codelets excite nodes once in each: by"
            " the tick nothing would last from one view to the next"
        ),
    ] = 0.1
    base_level_decay: Annotated[
        Unit,
        msgspec.Meta(
            description="What a node's base level loses in a cycle, 0 to 1. LIDA: 0.1 in a tick, of"
            " current activation; here so little, because a base level is memory: what one"
            " broadcast adds lasts for 40 s"
        ),
    ] = 0.0005
    place_decay: Annotated[
        Unit,
        msgspec.Meta(
            description="What a place node's activation loses in a cycle, 0 to 1. LIDA: 0.1 in a"
            " tick; here 0.02 in a cycle, because a place is excited only while the agent is at"
            " it: those of the last ten seconds stay active"
        ),
    ] = 0.02
    learning: Annotated[
        Literal["linear", "sigmoid"],
        msgspec.Meta(
            description="How the base level of what is conscious rises: by as much each time, or"
            " by less the nearer it is to 0 and 1"
        ),
    ] = "linear"
    learning_rate: Annotated[
        Unit,
        msgspec.Meta(
            description="What a node's base level gains in a broadcast, 0 to 1; a sigmoid gains as"
            " much at 0.5. Of five views a second with an object, half or more lead to a"
            " broadcast about it; what is seen once, perhaps by mistake, is conscious once. LIDA:"
            " no published rate that we know"
        ),
    ] = 0.1
    unlearning_rate: Annotated[
        Unit,
        msgspec.Meta(
            description="What the base level of a node that is broadcast as missing loses, times"
            " its salience, 0 to 1. What was known best is kept no longer then, and is forgotten"
            " at once when it is missing three times"
        ),
    ] = 0.4
    kept_base_level: Annotated[
        Unit,
        msgspec.Meta(
            description="A base level that was learned up to this does not decay below it: the"
            " node is not forgotten by time alone, 0 to 1; 0: every base level decays. With much"
            " less, objects are kept that were seen in a few views from one side: where these"
            " are placed badly they mislead localization later"
        ),
    ] = 0.9
    forget_below: Annotated[
        Unit,
        msgspec.Meta(
            description="A node is forgotten where its total activation falls below this, 0 to 1"
        ),
    ] = 0.05
    background_cycles: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=1000,
            description="In lockstep, cycles after which a background codelet's answer is "
            "committed",
        ),
    ] = 3
    background_lease_ms: Annotated[
        Milliseconds,
        msgspec.Meta(
            description="In real time, how long a worker may take for a background task, ms"
        ),
    ] = 5000.0
    goals: Annotated[
        list[GivenGoal], msgspec.Meta(description="Goals that the agent is given")
    ] = []
    goals_after_s: Annotated[
        float,
        msgspec.Meta(
            ge=0,
            le=1e6,
            description="Time from which on it has them, in s, 0 to 1e6; 0: from its start",
        ),
    ] = 0.0
    in_order: Annotated[
        bool,
        msgspec.Meta(
            description="Whether each of these goals counts once the one before is reached; false"
            " where the agent decides their order"
        ),
    ] = False
