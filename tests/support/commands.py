"""Commands of the command line, run in this process."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from click.testing import CliRunner, Result

from cli.main import cogmap


def log_command(*arguments: str | Path) -> Result:
    """`cogmap log` with these arguments; what it raises is raised."""
    words = ["log", *map(str, arguments)]
    result = CliRunner().invoke(cogmap, words, standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result


def log_facts(*arguments: str | Path) -> dict[str, Any]:
    """What `cogmap log` prints as JSON."""
    facts: dict[str, Any] = json.loads(log_command(*arguments, "--json").stdout)
    return facts
