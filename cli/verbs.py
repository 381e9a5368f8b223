"""Tables of verbs: a row has a verb's name, the place that it is imported from, and its help."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import click


class LazyCommand(click.Command):
    """A command that is imported when it is called: help and modules need none of the others.

    `place` is where it is found, as module:name.
    """

    def __init__(self, name: str, place: str, help_line: str) -> None:
        super().__init__(name, help=help_line)
        self.place = place

    def load(self) -> click.Command:
        """Import the command itself."""
        module, _, name = self.place.partition(":")
        command: click.Command = getattr(import_module(module), name)
        return command

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        return self.load().make_context(info_name, args, parent, **extra)


def add_verbs(group: click.Group, rows: Mapping[str, tuple[str, str]]) -> None:
    """Add the verbs of a table to `group`: by name, the place and the line of help of each."""
    for name, (place, help_line) in rows.items():
        group.add_command(LazyCommand(name, place, help_line))
