"""`python -m cogmap.training`, the same as `cogmap train`."""

from __future__ import annotations

from cogmap.runtime.command import run_command
from cogmap.training.command import train


def main() -> None:
    """Run the command."""
    run_command(train, "train", "python -m cogmap.training")


if __name__ == "__main__":
    main()
