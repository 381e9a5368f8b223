"""Describes a moment to people: its stages in order, each with its contents and the reasons."""

from __future__ import annotations

from dataclasses import dataclass, field

from cogmap.cli.explain import names, reasons
from cogmap.cli.explain.moment import Moment
from cogmap.schemas.cognition import Fate, Rejection
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.sensing import Percepts

BAR_CELLS = 10
EIGHTHS = " ▏▎▍▌▋▊▉█"
NOT_IN_LOG = "not in the log"


@dataclass(frozen=True)
class Row:
    """A line of a stage in columns; `is_chosen` where it is what won or was done."""

    cells: tuple[str, ...]
    is_chosen: bool = False


@dataclass(frozen=True)
class Stage:
    """A stage of the cycle: when it was done, what was in it, and why it came out so."""

    title: str
    after_ms: float | None
    rows: list[Row] = field(default_factory=list)
    why: list[str] = field(default_factory=list)


def headline(moment: Moment) -> str:
    """Say which moment it is."""
    return f"cycle {moment.cycle}, {moment.driven_s:.3f} s into the drive"


def stages(moment: Moment) -> list[Stage]:
    """Describe the stages of the cycle, in order."""
    return [
        perceived(moment),
        workspace(moment),
        competition(moment),
        conscious(moment),
        action(moment),
        command(moment),
    ]


def delay(after_ms: float | None) -> str:
    """Say how long after the view it was; empty if that is not known."""
    return "" if after_ms is None else f"+{after_ms:.0f} ms"


def bar(share: float) -> str:
    """Draw a bar of BAR_CELLS characters, full for 1."""
    eighths = round(min(1.0, max(0.0, share)) * BAR_CELLS * 8)
    whole, rest = divmod(eighths, 8)
    last = EIGHTHS[rest] if rest else ""
    return f"{'█' * whole}{last}".ljust(BAR_CELLS)


def recognised(percepts: Percepts) -> str:
    """Say in a few words what there is in percepts."""
    number = len(percepts.objects)
    plural = "" if number == 1 else "s"
    words = [f"{number or 'no'} object{plural}"]
    if percepts.road_m.shape[0]:
        words.append("road")
    for match in percepts.matches:
        words.append(f"a place seen before, in frame {match.frame} ({match.score:.2f})")
    return ", ".join(words)


def committed(delta: Delta) -> str:
    """Say what a delta commits: whose answers, if any, and how many operations."""
    number = len(delta.operations)
    operations = f"{number} operation{'' if number == 1 else 's'}"
    who = names.codelets(delta)
    return f"{who}: {operations}" if who else operations


def since(moment: Moment, name: str) -> str:
    """Say in which cycle the coalition with that id entered; empty if the log does not say."""
    entered = moment.entered.get(name)
    if entered is None:
        return ""
    if entered.cycle == moment.cycle:
        return "new"
    return f"since cycle {entered.cycle}"


def phases(moment: Moment) -> list[tuple[float | None, str, str]]:
    """List what the workspace did, in order: when, in which phase, whose answers it committed."""
    shown = [each for each in moment.deltas if each.message.operations or each.message.tasks]
    rows = [(each.after_ms, each.message.phase.value, committed(each.message)) for each in shown]

    found = moment.coalitions
    if found is not None:
        makers = [coalition.codelet for coalition in found.message.coalitions]
        plural = "" if len(makers) == 1 else "s"
        what = f"{names.counted(makers)}: {len(makers)} coalition{plural}"
        row = (found.after_ms, Phase.ATTENTION.value, what if makers else "no coalition")
        earlier = sum(delta.time_s <= found.time_s for delta in shown)
        rows.insert(earlier, row)
    return rows


def conscious_before(moment: Moment) -> str:
    """Say what was broadcast last before this cycle, and when."""
    earlier = moment.earlier_broadcast
    if earlier is None:
        return "nothing was conscious before"

    message = earlier.message
    ago_s = (moment.stamp_ns - message.stamp_ns) / 1e9
    name = names.spoken(message.coalition.codelet)
    words = names.content(message.coalition)
    return f"last, in cycle {message.cycle}, {ago_s:.2f} s before: {name}: {words}"


def perceived(moment: Moment) -> Stage:
    """Describe the objects that were recognised in the view."""
    if moment.percepts is None:
        return Stage("perceived", None, [Row((NOT_IN_LOG,))])

    percepts = moment.percepts.message
    rows = [Row((f"frame {percepts.frame}: {recognised(percepts)}",))]
    for percept in sorted(percepts.objects, key=lambda each: -each.activation):
        label = names.of_look(percept.name)
        where = names.of_percept(percept)
        cells = (*_measured(percept.activation), label, where, names.of_feelings(percept))
        rows.append(Row(cells))
    return Stage("perceived", moment.percepts.after_ms, rows)


def workspace(moment: Moment) -> Stage:
    """Describe the answers that the workspace committed, and those that it rejected."""
    rows = [Row((delay(after_ms), phase, what)) for after_ms, phase, what in phases(moment)]
    after_ms = moment.deltas[-1].after_ms if moment.deltas else None
    why = []
    for delta in moment.deltas:
        if delta.message.rejected:
            given = "; ".join(delta.message.reasons)
            why.append(f"Rejected answers: {delta.message.rejected}, as {given}.")
    return Stage("workspace", after_ms, rows or [Row((NOT_IN_LOG,))], why)


def competition(moment: Moment) -> Stage:
    """Describe the coalitions that competed for consciousness."""
    why = reasons.of_competition(moment)
    if moment.competition is None:
        return Stage("competition", None, why=why)

    ordered = reasons.ranked_contenders(moment.competition.message)
    rows = []
    for contender in ordered:
        entered = moment.entered.get(contender.id)
        cells = (
            *_measured(contender.activation),
            names.spoken(contender.codelet),
            contender.fate.value,
            since(moment, contender.id),
            "" if entered is None else names.brief(entered.coalition),
        )
        rows.append(Row(cells, contender.fate is Fate.WON))
    return Stage("competition", moment.competition.after_ms, rows, why)


def conscious(moment: Moment) -> Stage:
    """Describe the content that became conscious."""
    if moment.broadcast is None:
        return Stage("conscious", None, [Row((f"nothing new; {conscious_before(moment)}",))])

    coalition = moment.broadcast.message.coalition
    rows = [Row((names.content(coalition),), is_chosen=True)]
    entered = moment.entered.get(moment.winner)
    cycle = "a cycle that is not in the log" if entered is None else f"cycle {entered.cycle}"
    why = [f"It is coalition {moment.winner} of {names.spoken(coalition.codelet)}, from {cycle}."]
    if coalition.feeling:
        why.append(f"It is felt as {coalition.feeling}.")
    return Stage("conscious", moment.broadcast.after_ms, rows, why)


def action(moment: Moment) -> Stage:
    """Describe the action that was selected, and the other behaviours."""
    why = reasons.of_action(moment)
    if moment.action is None:
        return Stage("action", None, why=why)

    rows = []
    for behaviour in reasons.ranked_behaviours(moment.action.message):
        name = names.spoken(behaviour.scheme)
        cells = (*_measured(behaviour.activation), name, reasons.chosen(behaviour))
        rows.append(Row(cells, behaviour.rejection is Rejection.NONE))
    return Stage("action", moment.action.after_ms, rows, why)


def command(moment: Moment) -> Stage:
    """Describe the command that moved the wheels."""
    if moment.command is None:
        return Stage("command", None, [Row(("none that followed is in the log",))])

    given = moment.command.message
    wheels = f"{given.left_wheel_rad_s:.1f} and {given.right_wheel_rad_s:.1f} rad/s"
    rows = [Row((names.of_command(given), wheels), is_chosen=True)]
    why = []
    if given.stamp_ns != moment.stamp_ns:
        why.append(f"It answers the next view, that of {given.stamp_ns / 1e9:.3f} s.")
    return Stage("command", moment.command.after_ms, rows, why)


def _measured(activation: float) -> tuple[str, str]:
    return bar(activation), f"{activation:.2f}"
