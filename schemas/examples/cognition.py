"""Examples of the messages of the cognitive cycle."""

from __future__ import annotations

from cogmap.schemas.base import Message
from cogmap.schemas.cognition import (
    Action,
    Behaviour,
    Behaviours,
    Broadcast,
    Coalition,
    Coalitions,
    Competition,
    Contender,
    Direction,
    Fate,
    GuidanceScheme,
    MotorProgram,
    Rejection,
    Relation,
    Replay,
    RouteReplay,
    Silence,
    Trigger,
)
from cogmap.schemas.examples import nodes
from cogmap.schemas.examples.arrays import ramp
from cogmap.schemas.examples.graph import instance_link
from cogmap.schemas.feelings import Feeling


def messages() -> list[Message]:
    """A message of every type but the replays, from coalitions to the motor program."""
    return [
        Coalitions(cycle=6, coalitions=[coalition()]),
        _competition(),
        Broadcast(cycle=6, trigger="aggregate", coalition=coalition()),
        Behaviours(cycle=6, behaviours=_behaviours(), learned=[_guidance()]),
        _action(),
        MotorProgram(cycle=6, action="turn", parameters={"turn_rad": 1.5}),
    ]


def coalition() -> Coalition:
    """The agent and an object, linked."""
    return Coalition(
        id="6/whereabouts/0",
        codelet="whereabouts",
        activation=0.375,
        nodes=[nodes.self_node(), nodes.object_node()],
        links=[instance_link(weight=1.0)],
        maps=["map:1"],
        relations={nodes.object_node().id: _relation()},
        feeling=Feeling.NOVELTY,
    )


def replay() -> Replay:
    """A loop closed by reverse replay."""
    return Replay(
        cycle=6,
        replays=4,
        closed=["closure:0"],
        undone=["closure:1"],
        stamps_ns=ramp(3, dtype="<i8"),
        positions_m=ramp(3, 2, dtype="<f8"),
        shifts_m=ramp(3, 2, dtype="<f8"),
        pairs=ramp(1, 2, dtype="<i4"),
        strength_changes=ramp(1, dtype="<f8"),
        decay_per_m=0.2,
    )


def _competition() -> Competition:
    won = Contender(
        id="attention/6",
        codelet="attention",
        activation=0.375,
        fate=Fate.WON,
    )
    waiting = Contender(
        id="road/5",
        codelet="road",
        activation=0.25,
        fate=Fate.WAITING,
    )
    return Competition(
        cycle=6,
        contenders=[won, waiting],
        trigger=Trigger.AGGREGATE,
        silence=Silence.NO_TRIGGER,
    )


def _behaviours() -> list[Behaviour]:
    """One that may be chosen, and one whose context is missing."""
    follow = Behaviour(
        scheme="follow-route",
        activation=0.5,
        action="follow_plan",
        bindings={"plan": "plan"},
        context={"self": 1.0, "plan state=ready": 0.5},
        adding={"self stationary_since_ns=-1": 0.25},
        deleting=["plan state=no_route"],
        reliability=0.75,
        executions=4,
        successes=3,
        gathered=-0.125,
    )
    halt = Behaviour(
        scheme="halt",
        activation=0.0,
        rejection=Rejection.CONTEXT_MISSING,
        action="halt",
        context={"plan state=no_route": 0.0},
    )
    return [follow, halt]


def _relation() -> Relation:
    return Relation(look="bakery", range_m=12.5, bearing_rad=-0.25)


def _guidance() -> GuidanceScheme:
    return GuidanceScheme(
        name="guide_1",
        landmarks=[_relation()],
        path_m=[(0.0, 0.0), (2.0, 0.5)],
        executions=2,
        successes=1,
    )


def _action() -> Action:
    return Action(
        cycle=6,
        scheme="follow-route",
        action="follow_plan",
        activation=0.5,
        parameters={"speed_m_s": 3.0, "turn": "left"},
        behaviours=_behaviours(),
        threshold=0.5,
    )


def route_replay() -> RouteReplay:
    """A route replayed from its goal."""
    return RouteReplay(
        cycle=6,
        direction=Direction.REVERSE,
        goal="goal:bakery",
        map="map:1",
        cells=ramp(3, 2, dtype="<i4"),
    )
