"""How much room text takes, and text that is made to fit. All lengths are in inches."""

from __future__ import annotations

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextToPath

POINTS = 72.0
LEADING = 1.32
RENDERED = 1.04
"""Text that is rendered in pixels is a little wider than its outlines."""
ELLIPSIS = "…"
_measure = TextToPath()


def line_in(size: float) -> float:
    """Return the height of a line of text of `size` points."""
    return LEADING * size / POINTS


def width_of(text: str, size: float, is_bold: bool = False) -> float:
    """Measure how wide a text of `size` points is."""
    font = FontProperties(size=size, weight="bold" if is_bold else "normal")
    width, _, _ = _measure.get_text_width_height_descent(text, font, False)
    return RENDERED * float(width) / POINTS


def wrapped(text: str, width_in: float, size: float, most: int = 99) -> list[str]:
    """Split the text into lines of at most that width; leave out what exceeds `most` lines."""
    if not text:
        return []

    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".lstrip()
        if width_of(longer, size) <= width_in or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(word)

    if len(lines) > most:
        words = lines[most - 1].split()
        while len(words) > 1 and width_of(f"{' '.join(words)} {ELLIPSIS}", size) > width_in:
            words.pop()
        lines = [*lines[: most - 1], f"{' '.join(words)} {ELLIPSIS}"]
    return [shortened(line, width_in, size) for line in lines]


def shortened(text: str, width_in: float, size: float, is_bold: bool = False) -> str:
    """Return the text, or as many of its first letters as have room."""
    if width_of(text, size, is_bold) <= width_in:
        return text

    cut = text
    while cut and width_of(cut + ELLIPSIS, size, is_bold) > width_in:
        cut = cut[:-1]
    return cut + ELLIPSIS
