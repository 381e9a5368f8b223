"""`cogmap memory`: looks into the database of long-term memory, and carries it elsewhere."""

from __future__ import annotations

import click

from cogmap.cli.memory.inspect import check, show
from cogmap.cli.memory.transfer import export, import_

_EPILOG = """\b
Examples:
  cogmap memory show memory.db
  cogmap memory export memory.db memory.jsonl
  cogmap memory import memory.jsonl copy.db
"""


@click.group(epilog=_EPILOG)
def memory() -> None:
    """Look into the database of long-term memory; check, export and import it.

    No other process may have the database open meanwhile.
    """


for _command in (show, check, export, import_):
    memory.add_command(_command)
