"""Pins all that the container installs by hashes: `make hashes` runs `python -m
tests.support.hashes`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

REQUIREMENTS = Path(__file__).parents[2] / "requirements"
PINNED = ("run.txt", "build.txt")
PATH = REQUIREMENTS / "run.hashes.txt"
HEAD = """\
# What the container installs: every package of run.txt and build.txt and all that these need, with the SHA-256 of each
# file that was published of it, so that pip refuses any other. For Linux on x86_64 with Python 3.11. `make hashes`
# writes it anew.
"""  # noqa: E501
OPTIONS = (
    "--generate-hashes",
    "--allow-unsafe",
    "--strip-extras",
    "--no-annotate",
    "--no-header",
    "--no-emit-options",
    "--no-emit-index-url",
    "--no-emit-trusted-host",
    "--no-emit-find-links",
)
COMPILE = (sys.executable, "-m", "piptools", "compile", "--quiet", *OPTIONS)


def main() -> None:
    """Write the file. Exits with the code of `pip-compile` where that fails.

    What is pinned already stays at its version, with its hashes.
    """
    with tempfile.TemporaryDirectory() as folder:
        compiled = Path(folder) / PATH.name
        if PATH.exists():
            compiled.write_text(PATH.read_text())
        inputs = [str(REQUIREMENTS / name) for name in PINNED]
        run = subprocess.run([*COMPILE, "-o", str(compiled), *inputs], check=False)
        if run.returncode:
            sys.exit(run.returncode)
        PATH.write_text(HEAD + compiled.read_text())


if __name__ == "__main__":
    main()
