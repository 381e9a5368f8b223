"""What competes, what is conscious and why, as the page shows it. Pure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cogmap.cli.dashboard import parts
from cogmap.cli.dashboard.received import EXPLAINED, Received
from cogmap.cli.explain import names, reasons, text
from cogmap.cli.explain.moment import Moment
from cogmap.cli.explain.reading import Logged
from cogmap.graph.graph import Graph
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import (
    Action,
    Behaviour,
    Broadcast,
    Coalitions,
    Competition,
    Rejection,
)
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import Need
from cogmap.schemas.sensing import MotorCommand, Percepts
from cogmap.services.global_workspace.config import Config


def mind_part(received: Received, graph: Graph, settings: Config, place: Path) -> parts.Mind:
    """Return the last competitions, the needs, and the last action with its reasons.

    `settings` are those of the global workspace; `place` is where the messages come from.
    """
    mind = parts.Mind(competitions=_competitions(received))
    for need in graph.of_kind(Need):
        level = parts.NeedLevel(name=need.label, level=need.level, is_eased=need.is_eased)
        mind.needs.append(level)

    action = received.message(topics.ACTION)
    if isinstance(action, Action):
        mind.schemes = [_scheme(each) for each in reasons.ranked_behaviours(action)]
        moment = _moment(received, action.cycle, action.stamp_ns, settings, place)
        mind.explained = text.headline(moment)
        mind.stages = [_stage(each) for each in text.stages(moment)]
    return mind


def _competitions(received: Received) -> list[parts.Competed]:
    conscious = {each.cycle: each.coalition for each in received.broadcasts}
    found = []
    for each in received.competitions:
        contenders = [
            parts.Contending(
                codelet=names.spoken(contender.codelet),
                activation=round(contender.activation, 3),
                fate=contender.fate.value,
            )
            for contender in each.contenders
        ]
        competed = parts.Competed(cycle=each.cycle, at_s=each.stamp_ns / 1e9, contenders=contenders)
        if each.cycle in conscious:
            competed.conscious = names.content(conscious[each.cycle])
        found.append(competed)
    return found


def _scheme(behaviour: Behaviour) -> parts.Scheme:
    return parts.Scheme(
        name=names.spoken(behaviour.scheme),
        action=names.spoken(behaviour.action),
        activation=round(behaviour.activation, 3),
        verdict=reasons.chosen(behaviour),
        is_chosen=behaviour.rejection is Rejection.NONE,
    )


def _stage(stage: text.Stage) -> parts.ShownStage:
    return parts.ShownStage(
        title=stage.title,
        after=text.delay(stage.after_ms),
        rows=[parts.ShownRow(cells=row.cells, is_chosen=row.is_chosen) for row in stage.rows],
        why=stage.why,
    )


def _moment(received: Received, cycle: int, stamp_ns: int, settings: Config, place: Path) -> Moment:
    """Collect what was received lately of a cycle, whose view is of `stamp_ns`."""
    of_kind: dict[type[Message], list[Logged[Any]]] = {kind: [] for kind in EXPLAINED}
    for logged in received.explained:
        of_kind[type(logged.message)].append(logged)

    def of_cycle(kind: type[Message]) -> Logged[Any] | None:
        return next((each for each in of_kind[kind] if each.message.cycle == cycle), None)

    def before(kind: type[Message]) -> Logged[Any] | None:
        earlier = [each for each in of_kind[kind] if each.message.cycle < cycle]
        return earlier[-1] if earlier else None

    action = of_cycle(Action)
    since_s = action.time_s if action is not None else 0.0
    commands = [each for each in of_kind[MotorCommand] if each.time_s >= since_s]
    seen = [each for each in of_kind[Percepts] if each.message.stamp_ns == stamp_ns]
    return Moment(
        path=place,
        cycle=cycle,
        stamp_ns=stamp_ns,
        view=None,
        percepts=seen[0] if seen else None,
        deltas=[each for each in of_kind[Delta] if each.message.cycle == cycle],
        coalitions=of_cycle(Coalitions),
        competition=of_cycle(Competition),
        entered=received.entered,
        broadcast=of_cycle(Broadcast),
        earlier_broadcast=before(Broadcast),
        action=action,
        earlier_action=before(Action),
        command=commands[0] if commands else None,
        settings=settings,
    )
