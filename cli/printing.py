"""Prints what several commands print: JSON, tables, sizes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click
import msgspec
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

PIPED_WIDTH = 160
"""Columns of a table that no terminal limits: the widest of ours fits."""


def print_json(value: Any) -> None:
    """Print `value` as one indented JSON document."""
    click.echo(msgspec.json.format(msgspec.json.encode(value)).decode())


def megabytes(size_bytes: float) -> str:
    """Write a number of bytes in kB or MB."""
    if size_bytes >= 1e5:
        return f"{size_bytes / 1e6:.1f} MB"
    return f"{size_bytes / 1e3:.1f} kB"


def print_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a plain table. A column whose name ends with a colon holds words, any other numbers."""
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in columns:
        holds_words = name.endswith(":")
        shown.add_column(
            name.rstrip(":"), justify="left" if holds_words else "right", overflow="fold"
        )
    for row in rows:
        shown.add_row(*(escape(str(cell)) for cell in row))

    console = Console(soft_wrap=False, highlight=False)
    if not console.is_terminal:
        console.width = PIPED_WIDTH
    console.print(shown)
