"""The boxes of the competition, of what it broadcast, and of what was done."""

from __future__ import annotations

from cogmap.cli.explain import names, reasons, text
from cogmap.cli.explain.drawing.blocks import Bar, Block, Words
from cogmap.cli.explain.drawing.box import (
    BETWEEN,
    LARGE,
    MOST,
    SIZE,
    SMALL,
    Box,
    empty,
    heading,
    inner_in,
    note,
    others,
)
from cogmap.cli.explain.drawing.lettering import shortened, wrapped
from cogmap.cli.explain.drawing.robot import Robot
from cogmap.cli.explain.moment import Moment
from cogmap.cli.plots.palette import ESTIMATE, FAINT, PLAN, TRUE, WALL, WHEELS
from cogmap.schemas.cognition import Coalition, Fate, Rejection


def coalitions(moment: Moment) -> Box:
    """Make the box of every contender, the winner first, with its fate."""
    width_in = 2.35
    if moment.competition is None:
        return empty("coalitions", width_in, reasons.of_competition(moment))

    ordered = reasons.ranked_contenders(moment.competition.message)
    blocks: list[Block] = []
    for contender in ordered[:MOST]:
        has_won = contender.fate is Fate.WON
        colour = ESTIMATE if has_won else WALL
        name = names.spoken(contender.codelet)
        title = heading(name, contender.fate.value, width_in, colour if has_won else "")
        bar = Bar(contender.activation, colour, moment.settings.coalition_above)
        entered = moment.entered.get(contender.id)
        about = "" if entered is None else f"{text.since(moment, contender.id)}: "
        if entered is not None:
            about += names.brief(entered.coalition)
        lines = wrapped(about, inner_in(width_in), SMALL, 2)
        blocks += [title, bar, Words(lines, SMALL, FAINT), BETWEEN]
    blocks += others(len(ordered), width_in)
    if ordered:
        above = moment.settings.coalition_above
        blocks.append(note(f"mark: threshold of one, {above:.2f}", width_in))
    else:
        blocks.append(note("none competed", width_in))
    return Box("coalitions", WHEELS, width_in, moment.competition.after_ms, blocks)


def broadcast(moment: Moment) -> Box:
    """Make the box of what became conscious or, if nothing did, of what was before."""
    width_in = 2.15
    if moment.broadcast is None:
        sentences = ["none in this cycle", text.conscious_before(moment)]
        return empty("broadcast", width_in, sentences)

    coalition = moment.broadcast.message.coalition
    name = names.spoken(coalition.codelet)
    blocks: list[Block] = [
        Words([shortened(name, inner_in(width_in), LARGE, is_bold=True)], LARGE, ESTIMATE, True),
        note(_origin(moment), width_in),
        BETWEEN,
        *_content(coalition, width_in),
        BETWEEN,
    ]
    trigger = f"triggered by: {moment.broadcast.message.trigger}"
    blocks.append(note(trigger, width_in))
    return Box("broadcast", ESTIMATE, width_in, moment.broadcast.after_ms, blocks)


def _origin(moment: Moment) -> str:
    """Say which coalition is conscious, and since when."""
    since = text.since(moment, moment.winner)
    return f"{moment.winner}, {since}" if since else moment.winner


def _content(coalition: Coalition, width_in: float) -> list[Block]:
    blocks: list[Block] = []
    for node in coalition.nodes[:MOST]:
        lines = wrapped(names.of_node(node), inner_in(width_in), SIZE, 2)
        blocks.append(Words(lines))
    return [*blocks, *others(len(coalition.nodes), width_in)]


def behaviours(moment: Moment) -> Box:
    """Make the box of the schemes considered, the chosen one first, with reasons of rejection."""
    width_in = 2.0
    if moment.action is None:
        return empty("behaviours", width_in, reasons.of_action(moment))

    ordered = reasons.ranked_behaviours(moment.action.message)
    blocks: list[Block] = []
    for behaviour in ordered[:MOST]:
        is_chosen = behaviour.rejection is Rejection.NONE
        colour = PLAN if is_chosen else WALL
        name = names.spoken(behaviour.scheme)
        fate = "chosen" if is_chosen else ""
        title = heading(name, fate, width_in, colour if is_chosen else "")
        why = wrapped(behaviour.rejection.value, inner_in(width_in), SMALL, 3)
        blocks += [title, Bar(behaviour.activation, colour), Words(why, SMALL, FAINT), BETWEEN]
    blocks += others(len(ordered), width_in)
    if not ordered:
        blocks.append(heading(names.spoken(moment.action.message.scheme), "", width_in, PLAN))
    return Box("behaviours", PLAN, width_in, moment.action.after_ms, blocks)


def command(moment: Moment) -> Box:
    """Make the box of how the wheels were driven next."""
    width_in = 1.8
    if moment.command is None:
        return empty("command", width_in, ["none that followed is in the log"])

    sent = moment.command.message
    blocks: list[Block] = [
        Words(wrapped(names.of_command(sent), inner_in(width_in), SIZE)),
        Robot(sent.left_wheel_rad_s, sent.right_wheel_rad_s, TRUE),
        note("wheels, in rad/s", width_in),
    ]
    if sent.stamp_ns != moment.stamp_ns:
        blocks.append(note(f"for the view of {sent.stamp_ns / 1e9:.3f} s", width_in))
    return Box("command", TRUE, width_in, moment.command.after_ms, blocks)
