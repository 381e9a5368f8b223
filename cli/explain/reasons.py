"""Gives the reasons, in sentences, for what became conscious and for the chosen action."""

from __future__ import annotations

from cogmap.cli.explain.moment import Moment
from cogmap.cli.explain.names import spoken
from cogmap.schemas.cognition import (
    Action,
    Behaviour,
    Competition,
    Contender,
    Fate,
    Rejection,
    Trigger,
)
from cogmap.services.global_workspace.config import TICK_MS

OUT_OF_IT = frozenset({Fate.DISPLACED, Fate.DECAYED})


def of_competition(moment: Moment) -> list[str]:
    """Explain why the competition ended as it did."""
    if moment.competition is None and moment.broadcast is not None:
        trigger = moment.broadcast.message.trigger
        return [f"The broadcast was triggered by: {trigger}; the log does not hold who competed."]
    if moment.competition is None:
        return [
            "The log holds no competition of this cycle: its attention codelets had not answered "
            "by its end, or it was not recorded."
        ]

    competition = moment.competition.message
    winner = won(competition)
    if winner is None or not competition.trigger:
        return [why_none(moment, competition)]
    return [why_most_active(competition, winner), why_now(moment, competition)]


def of_action(moment: Moment) -> list[str]:
    """Explain why the action was chosen; if none was, which one continues."""
    if moment.action is not None:
        return why_chosen(moment.action.message)

    continues = "there is no action yet"
    if moment.earlier_action is not None:
        action = moment.earlier_action.message
        continues = f"{spoken(action.scheme)}, chosen in cycle {action.cycle}, continues"
    if moment.broadcast is None:
        return [f"Without a broadcast nothing is chosen: {continues}."]
    return [
        "The broadcast led to no action: no behaviour was active enough, or the log ends before "
        f"it; {continues}."
    ]


def won(competition: Competition) -> Contender | None:
    """Return the contender that was broadcast, if one was."""
    for contender in competition.contenders:
        if contender.fate is Fate.WON:
            return contender
    return None


def ranked_contenders(competition: Competition) -> list[Contender]:
    """Sort the contenders: the winner first, then the others by activation."""
    return sorted(
        competition.contenders, key=lambda each: (each.fate is not Fate.WON, -each.activation)
    )


def ranked_behaviours(action: Action) -> list[Behaviour]:
    """Sort the behaviours: the chosen one first, then the others by activation."""
    return sorted(
        action.behaviours,
        key=lambda each: (each.rejection is not Rejection.NONE, -each.activation),
    )


def next_best(action: Action) -> Behaviour | None:
    """Find the most active behaviour that was not chosen, if there is one."""
    others = [each for each in action.behaviours if each.rejection is not Rejection.NONE]
    return max(others, key=lambda each: each.activation, default=None)


def chosen(behaviour: Behaviour) -> str:
    """Say what became of a behaviour."""
    if behaviour.rejection is Rejection.NONE:
        return "chosen"
    return f"rejected: {behaviour.rejection.value}"


def why_most_active(competition: Competition, winner: Contender) -> str:
    name = _beginning(winner.codelet)
    others = [each for each in _competing(competition) if each.id != winner.id]
    rival = max(others, key=lambda each: each.activation, default=None)
    if rival is None:
        return f"{name} won, as nothing else competed."

    rival_name = spoken(rival.codelet)
    margin = winner.activation - rival.activation
    if margin > 0:
        return f"{name} won as the most active, {margin:.2f} ahead of {rival_name}."
    if margin == 0:
        return f"{name} won, as active as {rival_name}: of equals the first by name wins."
    return f"{name} won, though {rival_name} was more active by {-margin:.2f}."


def why_now(moment: Moment, competition: Competition) -> str:
    """Say what triggered the broadcast, with the figures if the trigger is one known here."""
    settings = moment.settings
    activations = [each.activation for each in _competing(competition)]
    strongest = max(activations)
    silent_s = _silent_s(moment)
    figures = ""
    match competition.trigger:
        case Trigger.ONE_COALITION:
            figures = f", {strongest:.2f} over {settings.coalition_above:.2f}"
        case Trigger.AGGREGATE:
            figures = f", {sum(activations):.2f} over {settings.aggregate_above:.2f}"
        case Trigger.NO_BROADCAST if silent_s is not None:
            limit_s = settings.no_broadcast_ticks * TICK_MS / 1e3
            figures = f", {silent_s:.2f} s where {limit_s:.2f} s suffice"
    return f"The broadcast was triggered by: {competition.trigger.value}{figures}."


def why_none(moment: Moment, competition: Competition) -> str:
    """Explain why a competition triggered no broadcast, by the global workspace's settings."""
    if competition.trigger:
        return f"A broadcast was triggered by: {competition.trigger.value}; the log has no winner."

    activations = [each.activation for each in _competing(competition)]
    if not activations:
        return "It triggered no broadcast: no coalition was left to compete."

    settings = moment.settings
    silent_s = _silent_s(moment)
    refractory_s = settings.refractory_ticks * TICK_MS / 1e3
    if silent_s is not None and silent_s < refractory_s:
        return (
            f"It triggered no broadcast, being refractory: the last was {silent_s:.2f} s before, "
            f"and {refractory_s:.2f} s must pass."
        )

    needs = [
        f"the strongest coalition had {max(activations):.2f} and needed more than "
        f"{settings.coalition_above:.2f}",
        f"all together had {sum(activations):.2f} and needed more than "
        f"{settings.aggregate_above:.2f}",
    ]
    if silent_s is not None:
        limit_s = settings.no_broadcast_ticks * TICK_MS / 1e3
        needs.append(f"the last broadcast was {silent_s:.2f} s before, short of {limit_s:.2f} s")
    return f"It triggered no broadcast: {'; '.join(needs)}."


def why_chosen(action: Action) -> list[str]:
    name = _beginning(action.scheme)
    rival = next_best(action)
    if rival is None:
        return [f"{name} was chosen, the only behaviour considered."]

    rival_name = spoken(rival.scheme)
    return [
        f"{name} was chosen with {action.activation:.2f}.",
        f"The next best, {rival_name}, had {rival.activation:.2f}: {rival.rejection.value}.",
    ]


def _beginning(name: str) -> str:
    """Write a name for the beginning of a sentence."""
    words = spoken(name)
    return words[:1].upper() + words[1:]


def _competing(competition: Competition) -> list[Contender]:
    """Return the contenders that were there when the broadcast was triggered."""
    return [each for each in competition.contenders if each.fate not in OUT_OF_IT]


def _silent_s(moment: Moment) -> float | None:
    """Return how long before this cycle the last broadcast was; None if there was none."""
    if moment.earlier_broadcast is None:
        return None
    return (moment.stamp_ns - moment.earlier_broadcast.message.stamp_ns) / 1e9
