"""Prints a moment on the screen."""

from __future__ import annotations

from itertools import groupby

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from cogmap.cli.explain.moment import Moment
from cogmap.cli.explain.text import Row, Stage, delay, headline, stages

PIPED_WIDTH = 120
TITLE = "bold"
FAINT = "dim"
CHOSEN = "bold green"


def print_moment(moment: Moment) -> None:
    """Print the stages of a moment, one below the other."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = PIPED_WIDTH

    title = Text(headline(moment), TITLE)
    title.append(f"  {moment.at_s:.3f} s into {moment.path}", FAINT)
    console.print(title)
    console.print()

    shown = stages(moment)
    table = Table.grid(padding=(0, 2))
    table.add_column(style=TITLE, no_wrap=True)
    table.add_column(style=FAINT, justify="right", no_wrap=True)
    table.add_column()
    for stage in shown:
        table.add_row(stage.title, delay(stage.after_ms), _inside(stage))
        if stage is not shown[-1]:
            table.add_row()
    console.print(table)


def _inside(stage: Stage) -> Group:
    """Lay out the rows of a stage, and below them why it came out so."""
    parts: list[RenderableType] = []
    for _, rows in groupby(stage.rows, key=lambda row: len(row.cells)):
        parts.append(_columns(list(rows)))
    parts += [Text(sentence, "italic") for sentence in stage.why]
    return Group(*parts)


def _columns(rows: list[Row]) -> Table:
    """Lay out rows that have equally many cells; the last cell may take several lines."""
    table = Table.grid(padding=(0, 2))
    last = len(rows[0].cells) - 1
    for number in range(last + 1):
        table.add_column(no_wrap=number < last)
    for row in rows:
        table.add_row(*row.cells, style=CHOSEN if row.is_chosen else "")
    return table
