"""`cogmap memory`: looks into the database of long-term memory, and carries it elsewhere."""

from __future__ import annotations

import click

from cogmap.cli.verbs import add_verbs

VERBS = {
    "show": ("cogmap.cli.memory.show:show", "Show how many records of each kind there are."),
    "check": ("cogmap.cli.memory.show:check", "Check every page and every record."),
    "export": ("cogmap.cli.memory.transfer:export", "Write all records as JSON lines."),
    "import": ("cogmap.cli.memory.transfer:import_", "Make a database from an export."),
}
_EPILOG = """\b
Examples:
  cogmap memory show memory.db
  cogmap memory export memory.db memory.jsonl
  cogmap memory import memory.jsonl copy.db
"""


@click.group(epilog=_EPILOG)
def memory() -> None:
    """Show, check, export and import the database of long-term memory.

    No other process may have the database open at the same time.
    """


add_verbs(memory, VERBS)
