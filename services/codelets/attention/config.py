"""The settings of the attention codelets."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from cogmap import robot
from cogmap.schemas.base import PositiveMetres, PositiveRadians, PositiveShare, Share

SECTION = "attention"

BaseLevel = Annotated[Share, Meta(description="Base-level activation of its coalitions, 0 to 1.")]
Refractory = Annotated[
    int,
    Meta(
        ge=0,
        le=10_000,
        description="Refractory period: cycles that it waits after it has brought a coalition, "
        "0 to 10000. LIDA: 50 ticks; here 1 cycle, because codelets run once in each, and 50 ticks "
        "of 5 ms end within the second.",
    ),
]
Count = Annotated[int, Meta(ge=1, le=10_000)]


class Whereabouts(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The default codelet brings what is active in each view: without it consciousness would be
    empty wherever nothing happens, and no action would be chosen.
    """

    base_level: BaseLevel = 1.0
    refractory_cycles: Annotated[
        Refractory,
        Meta(
            description="Refractory period: cycles that it waits after it has brought a coalition, "
            "0 to 10000. LIDA: 50 ticks; here 0, because it is the default: without it nothing is "
            "conscious where nothing happens."
        ),
    ] = 0


class Novelty(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What is new to the agent."""

    base_level: BaseLevel = 1.0
    refractory_cycles: Refractory = 1
    novel_sightings: Annotated[
        Count, Meta(description="Views in which an object has been seen at most while it is new.")
    ] = 5


class Expectation(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Which objects are expected in view, and when it is a surprise that they are not.

    They are to stand inside the view and nearer than perception reaches, and either the rays of
    the range scan pass where they stood, or nothing that is known hides them: what is hidden is no
    surprise.
    """

    base_level: BaseLevel = 1.0
    refractory_cycles: Refractory = 1
    views: Annotated[
        Count,
        Meta(
            description="Views in which an object is missing, since it was seen last, before "
            "that is a surprise, 1 to 10000: perception misses one of twenty. Half as many do in "
            "which the rays of the range scan pass where it stood."
        ),
    ] = 4
    established_sightings: Annotated[
        Count, Meta(description="Views in which an object was seen that is expected, 1 to 10000.")
    ] = 10
    nearest_m: Annotated[
        PositiveMetres,
        Meta(description="Least distance of an object that is expected, in m, above 0 to 10000."),
    ] = 8.0
    farthest_m: Annotated[
        PositiveMetres,
        Meta(
            description="Greatest distance of an object that is expected, in m, above 0 to 10000."
        ),
    ] = 35.0
    field_of_view_rad: Annotated[
        PositiveRadians,
        Meta(
            description="Angle within which perception sees an object whole, in rad, above 0 to "
            "6.28. Aside of it only rays that pass where an object stood say that it is gone."
        ),
    ] = 1.28
    largest_sd_m: Annotated[
        PositiveMetres,
        Meta(
            description="Nothing is expected where the position of the agent, or of the object, is "
            "less certain, standard deviation in m, above 0 to 10000."
        ),
    ] = 2.0
    passed_share: Annotated[
        PositiveShare,
        Meta(
            description="Share of the rays towards an object that pass where it stood, from which "
            "on it is missing, above 0 to 1."
        ),
    ] = 0.6


class Goal(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Goals and plans last for minutes: once a second is enough for what has not changed."""

    base_level: BaseLevel = 1.0
    refractory_cycles: Annotated[
        Refractory,
        Meta(
            description="Refractory period: cycles that it waits after it has brought a coalition, "
            "0 to 10000. LIDA: 50 ticks; here 4 cycles, because goals and plans last for minutes: "
            "once a second is enough."
        ),
    ] = 4
    change_salience: Annotated[
        Share, Meta(description="Salience of a plan that is new and of a goal reached, 0 to 1.")
    ] = 0.5


class Need(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A need lasts for minutes too."""

    base_level: BaseLevel = 1.0
    refractory_cycles: Annotated[
        Refractory,
        Meta(
            description="Refractory period: cycles that it waits after it has brought a coalition, "
            "0 to 10000. LIDA: 50 ticks; here 4 cycles, because a need lasts for minutes: once a "
            "second is enough."
        ),
    ] = 4
    high_level: Annotated[
        PositiveShare, Meta(description="Level from which on a need is high, above 0 to 1.")
    ] = 0.5


class Danger(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What stands so near ahead that the agent may run into it."""

    base_level: BaseLevel = 1.0
    refractory_cycles: Refractory = 1
    nearest_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance within which something ahead is a danger, in m, above 0 to "
            "10000: little more than motor.clearance_m, at which the robot is stopped."
        ),
    ] = robot.CLEARANCE_M + 0.4
    same_cycles: Annotated[
        Count,
        Meta(
            description="Cycles without a danger after which one is another, and brought again, "
            "1 to 10000."
        ),
    ] = 25


class PlaceLost(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Whether the agent knows where it is."""

    base_level: BaseLevel = 1.0
    refractory_cycles: Refractory = 1


class Episode(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """An episode decays within two seconds: it is brought once."""

    base_level: BaseLevel = 1.0
    refractory_cycles: Annotated[
        Refractory,
        Meta(
            description="Refractory period: cycles that it waits after it has brought a coalition, "
            "0 to 10000. LIDA: 50 ticks; here 10 cycles, because the node of an episode decays "
            "within as many: it is brought once."
        ),
    ] = 10


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The attention codelets, each by its name.

    LIDA's refractory period of an attention codelet is 50 ticks of 5 ms, which end within the
    second cycle of 200 ms: one cycle is waited. It is counted in cycles, for attention codelets run
    once in each, so that a run depends on no clock.
    """

    whereabouts: Annotated[
        Whereabouts, Meta(description="The agent among what it sees: the default.")
    ] = Whereabouts()
    novelty: Annotated[Novelty, Meta(description="What is new to the agent in view.")] = Novelty()
    expectation: Annotated[Expectation, Meta(description="What was expected and is not so.")] = (
        Expectation()
    )
    goal: Annotated[Goal, Meta(description="The open goals, and the plan that leads to them.")] = (
        Goal()
    )
    need: Annotated[Need, Meta(description="A need that is high.")] = Need()
    danger: Annotated[Danger, Meta(description="What stands near ahead.")] = Danger()
    place_lost: Annotated[PlaceLost, Meta(description="The agent is lost, or was found again.")] = (
        PlaceLost()
    )
    episode: Annotated[
        Episode, Meta(description="An episode that long-term memory was reminded of.")
    ] = Episode()
