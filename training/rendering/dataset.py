"""Renders what perception is trained on: `python -m training.rendering.dataset --out DIR`.

The simulator draws towns from seeds, each view in a light of its own and from another place, and
labels what it knows; sensory memory adds the depth that its stereo gives. Towns for training are in
DIR/train, and in DIR/strangers more of them, for learning what tells buildings apart; those to
choose and calibrate by are in DIR/val, and those for tests in DIR/test: no town is in two of them,
and none of the invented kinds of building. A file that is there already is kept, so an interrupted
command goes on where it was; the same command gives the same files.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from rich.progress import Progress

from cogmap.errors import CogmapError, UsageError


@dataclass(frozen=True)
class Split:
    """Towns `first` and on, in turn with as many invented kinds of building as `unknown` says."""

    name: str
    first: int
    towns: int
    views: int
    unknown: tuple[int, ...] = (0, 14, 28)


SPLITS = (
    Split("train", 1001, 84, 110),
    Split("strangers", 5001, 140, 45, (30,)),
    Split("val", 2001, 6, 90),
    Split("test", 3001, 6, 90),
)


@dataclass(frozen=True)
class Job:
    """One town to be rendered to `target`."""

    seed: int
    views: int
    unknown: int
    target: Path


def jobs(out: Path, scale: float) -> Iterator[Job]:
    """What there is to render, the towns of each split times `scale`."""
    for split in SPLITS:
        for number in range(max(1, round(scale * split.towns))):
            seed = split.first + number
            yield Job(
                seed,
                split.views,
                split.unknown[number % len(split.unknown)],
                out / split.name / f"town-{seed}.npz",
            )


def render(job: Job) -> None:
    """Render the town of `job`, unless it is there. Raises CogmapError where the simulator or
    sensory memory fails.
    """
    if job.target.exists():
        return
    job.target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".part-", dir=job.target.parent) as folder:
        drawn = Path(folder) / job.target.name
        seen = Path(folder) / "seen.npz"
        counts = ["--views", str(job.views), "--invented", str(job.unknown)]
        _run("training.rendering.towns", "--out", folder, "--seeds", str(job.seed), *counts)
        _run("training.rendering.views", str(drawn), str(seen))
        seen.replace(job.target)


def _run(module: str, *arguments: str) -> None:
    environment = os.environ | {"OMP_NUM_THREADS": "1", "LP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    if done.returncode:
        reason = (done.stderr.strip() or done.stdout.strip() or "no word").splitlines()[-1]
        raise CogmapError(f"{module} failed: {reason}")


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m training.rendering.dataset", description=__doc__
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for the renderings"
    )
    parser.add_argument(
        "--scale", type=float, default=1.0, metavar="X", help="times as many towns (default 1)"
    )
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="towns at a time"
    )
    arguments = parser.parse_args()
    try:
        if arguments.scale <= 0 or arguments.jobs < 1:
            raise UsageError("--scale must be over 0 and --jobs at least 1")
        _render_all(list(jobs(arguments.out, arguments.scale)), arguments.jobs)
    except (CogmapError, OSError) as error:
        sys.exit(f"dataset: {error}")


def _render_all(wanted: list[Job], at_a_time: int) -> None:
    with Progress() as progress, ThreadPoolExecutor(at_a_time) as pool:
        task = progress.add_task("towns", total=len(wanted))
        running = [pool.submit(render, job) for job in wanted]
        try:
            for done in as_completed(running):
                done.result()
                progress.advance(task)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


if __name__ == "__main__":
    main()
