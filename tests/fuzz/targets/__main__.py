"""`python -m tests.fuzz.targets [NAME]...`: run targets under atheris, each for some seconds."""

from __future__ import annotations

import argparse
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

MISSING = (
    "coverage-guided fuzzing needs atheris, which is not installed: install it by "
    "`pip install atheris`, or run `python -m benchmarks fuzz`, which needs nothing"
)
MAX_BYTES = 1 << 16
HANG_S = 10
MEMORY_MB = 2048


def written(name: str, folder: Path) -> Path:
    """Write the corpus of a target into a folder of its name, beside what atheris has found."""
    from tests.fuzz.targets.table import targets

    corpus = folder / name
    corpus.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(targets()[name].corpus()):
        (corpus / f"sample-{number}").write_bytes(content)
    return corpus


def run(name: str, folder: Path, seconds: int) -> None:
    """Run one target in this process, which atheris ends. What it is to follow is imported here."""
    import atheris

    with atheris.instrument_imports(include=["cogmap", "mcap", "rosbags"]):
        from tests.fuzz.targets.table import targets

    target = targets()[name]
    corpus = written(name, folder)
    options = [
        f"-max_total_time={seconds}",
        f"-max_len={MAX_BYTES}",
        f"-timeout={HANG_S}",
        f"-rss_limit_mb={MEMORY_MB}",
        f"-artifact_prefix={folder}/{name}-",
    ]
    atheris.Setup([sys.argv[0], *options, str(corpus)], target.run)
    atheris.Fuzz()


def main() -> int:
    """Run the targets that are named, all of them if none is. The code is 1 if one has failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--seconds", type=int, default=60, help="For each target.")
    parser.add_argument("--corpus", type=Path, default=Path(".fuzz"), help="A folder for a target.")
    parser.add_argument("--list", action="store_true", help="Print the targets' names alone.")
    parser.add_argument("--write", action="store_true", help="Write the corpora alone.")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()

    is_run = not (chosen.list or chosen.write)
    if is_run and find_spec("atheris") is None:
        print(MISSING, file=sys.stderr)  # noqa: T201
        return 2
    if chosen.here:
        run(chosen.names[0], chosen.corpus, chosen.seconds)
        return 0

    from tests.fuzz.targets.table import targets

    names = chosen.names or sorted(targets())
    unknown = sorted(set(names) - targets().keys())
    if unknown:
        print(f"no target {unknown[0]}: see --list", file=sys.stderr)  # noqa: T201
        return 2
    if chosen.list:
        print("\n".join(names))  # noqa: T201
        return 0
    if chosen.write:
        for name in names:
            written(name, chosen.corpus)
        return 0
    # Atheris ends the process of a target.
    failed = 0
    for name in names:
        common = ["--here", "--seconds", str(chosen.seconds), "--corpus", str(chosen.corpus)]
        done = subprocess.run(
            [sys.executable, "-m", "tests.fuzz.targets", *common, name], check=False
        )
        failed |= done.returncode != 0
    return failed


if __name__ == "__main__":
    sys.exit(main())
