"""`python -m benchmarks`: prints metrics beside their thresholds, and writes JSON."""

from __future__ import annotations

from benchmarks.commands import benchmarks
from cogmap.runtime.command import run_command


def main() -> None:
    """Run a benchmark; what the user can mend is one sentence and exit code 2."""
    run_command(benchmarks, "benchmarks", "python -m benchmarks")


if __name__ == "__main__":
    main()
