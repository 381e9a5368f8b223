"""A box of a cycle's picture, and what is common to all of them. All lengths are in inches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cogmap.cli.explain.drawing.blocks import Block, Gap, Words
from cogmap.cli.explain.drawing.lettering import shortened, width_of, wrapped
from cogmap.cli.plots.palette import FAINT, INK

PAD_IN = 0.14
MOST = 8
LARGE = 10.5
SIZE = 8.5
SMALL = 7.5
BETWEEN = Gap(0.1)


@dataclass(frozen=True)
class Box:
    """A stage: `width_in` wide, done `after_ms` after the view, with `blocks` from top to bottom.

    `image_in` is the height that is left at its top for an image. `is_empty` where nothing happened
    in it.
    """

    title: str
    colour: str
    width_in: float
    after_ms: float | None
    blocks: Sequence[Block]
    image_in: float = 0.0
    is_empty: bool = False

    @property
    def inner_in(self) -> float:
        """Return the width of what stands in it."""
        return self.width_in - 2 * PAD_IN

    @property
    def height_in(self) -> float:
        """Return the height of what stands in it."""
        return self.image_in + sum(block.height_in for block in self.blocks)


def inner_in(width_in: float) -> float:
    """Return the width that is left for what stands in a box of that width."""
    return width_in - 2 * PAD_IN


def note(words: str, width_in: float) -> Words:
    """Make small print for a box of that width."""
    return Words(wrapped(words, inner_in(width_in), SMALL), SMALL, FAINT)


def heading(words: str, at_right: str, width_in: float, colour: str = "") -> Words:
    """Make a heading: the name of an entry and, at the right, its fate; in `colour` if it won."""
    room_in = inner_in(width_in)
    if at_right:
        room_in -= width_of(at_right, SIZE, is_bold=True) + 0.08
    return Words(
        [shortened(words, room_in, SIZE, is_bold=True)],
        SIZE,
        is_bold=bool(colour),
        at_right=at_right,
        right_colour=colour or FAINT,
    )


def others(number: int, width_in: float) -> list[Block]:
    """Note how many more than MOST there are of something."""
    return [note(f"and {number - MOST} more", width_in)] if number > MOST else []


def empty(title: str, width_in: float, sentences: Sequence[str]) -> Box:
    """Make the box of a stage that did not happen, and why."""
    blocks: list[Block] = []
    for sentence in sentences:
        blocks += [Words(wrapped(sentence, inner_in(width_in), SIZE), SIZE, INK), BETWEEN]
    return Box(title, FAINT, width_in, None, blocks, is_empty=True)
