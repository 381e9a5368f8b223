"""The boxes of what was sensed, perceived and made of it in the workspace."""

from __future__ import annotations

from cogmap.cli.explain import names, text
from cogmap.cli.explain.drawing.blocks import Bar, Block, Words
from cogmap.cli.explain.drawing.box import (
    BETWEEN,
    MOST,
    SMALL,
    Box,
    empty,
    heading,
    inner_in,
    note,
    others,
)
from cogmap.cli.explain.drawing.lettering import wrapped
from cogmap.cli.explain.moment import Moment
from cogmap.cli.plots import draw
from cogmap.cli.plots.palette import FAINT, FUSED, OBJECT, TRUE

SENSED_IN = 2.3


def sensed(moment: Moment, aspect: float) -> Box:
    """Make the box of the view, `aspect` times as high as wide; the image is not drawn here."""
    width_in = SENSED_IN
    blocks: list[Block] = []
    image_in = 0.0
    if moment.view is None:
        blocks.append(note("no view in the log", width_in))
    else:
        image_in = inner_in(width_in) * aspect + 0.08
        blocks.append(note(f"view of frame {moment.view.message.frame}", width_in))

    if moment.percepts is not None:
        blocks.append(note(text.recognised(moment.percepts.message), width_in))
    after_ms = None if moment.view is None else moment.view.after_ms
    return Box("sensed", TRUE, width_in, after_ms, blocks, image_in)


def percepts(moment: Moment) -> Box:
    """Make the box of what was recognised, the surest first, in the colours of the image."""
    width_in = 1.85
    if moment.percepts is None:
        return empty("percepts", width_in, [text.NOT_IN_LOG])

    objects = moment.percepts.message.objects
    coloured = list(zip(objects, draw.colours_of(objects), strict=True))
    coloured.sort(key=lambda each: -each[0].activation)
    blocks: list[Block] = []
    for percept, colour in coloured[:MOST]:
        label = heading(names.of_look(percept.name), "", width_in)
        lines = [names.of_percept(percept)]
        if percept.feelings:
            lines += wrapped(names.of_feelings(percept), inner_in(width_in), SMALL, 2)
        where = Words(lines, SMALL, FAINT)
        blocks += [label, Bar(percept.activation, colour), where, BETWEEN]
    blocks += others(len(coloured), width_in)
    if not coloured:
        blocks.append(note("nothing recognised", width_in))
    return Box("percepts", OBJECT, width_in, moment.percepts.after_ms, blocks)


def workspace(moment: Moment) -> Box:
    """Make the box of what each phase committed, and whose answers that was."""
    width_in = 2.15
    blocks: list[Block] = []
    for after_ms, phase, what in text.phases(moment):
        blocks.append(heading(phase, text.delay(after_ms), width_in))
        blocks.append(Words(wrapped(what, inner_in(width_in), SMALL, 3), SMALL, FAINT))
        blocks.append(BETWEEN)
    if not blocks:
        return empty("workspace", width_in, [text.NOT_IN_LOG])
    after_ms = moment.deltas[-1].after_ms if moment.deltas else None
    return Box("workspace", FUSED, width_in, after_ms, blocks)
