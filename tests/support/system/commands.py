"""Commands of the command line, run in this process."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from click.testing import CliRunner, Result

from cogmap.cli.main import cogmap


def log_command(*arguments: str | Path, code: int = 0) -> Result:
    """`cogmap log` with these arguments, which must end with `code`. Raises what it raises."""
    words = ["log", *map(str, arguments)]
    result = CliRunner().invoke(cogmap, words, standalone_mode=False)
    error = result.exception
    if error is not None and not isinstance(error, SystemExit):
        raise error

    assert result.exit_code == code, result.output
    return result


def log_facts(*arguments: str | Path, code: int = 0) -> dict[str, Any]:
    """What `cogmap log` prints as JSON."""
    result = log_command(*arguments, "--json", code=code)
    facts: dict[str, Any] = json.loads(result.stdout)
    return facts
