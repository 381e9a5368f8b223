"""Mutated files of every format, and crafted ones, through every reader."""

from __future__ import annotations

import gc
import logging
import os
import random
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.fuzz.bombs import bombs
from benchmarks.fuzz.mutations import changed
from benchmarks.fuzz.readers import Format, formats
from benchmarks.fuzz.samples import Files
from benchmarks.fuzz.watch import Findings, rss_mb

TOLD_EVERY = 100
STANDARD_ERROR = 2


def campaign(
    seed: str, count: int, until_s: float, tell: Callable[[int], None], folder: Path
) -> Findings:
    """Read `count` mutated files, or as many as there is time for up to the monotonic `until_s`,
    formats in turn, after every crafted file once, and `tell` now and then how many more were read.
    """
    logging.disable(logging.CRITICAL)
    with _standard_error_to(folder / "decoders.txt"):
        return _read(seed, count, until_s, tell, folder)


def _read(
    seed: str, count: int, until_s: float, tell: Callable[[int], None], folder: Path
) -> Findings:
    findings = Findings()
    rng = random.Random(f"files {seed}")
    table = [*formats().values()]
    wholes = [(each, each.sample()) for each in table]
    for form, files in wholes:
        read(form, files, folder, Findings())

    for form, files in bombs():
        read(form, files, folder, findings)
    gc.collect()
    baseline_mb = rss_mb()
    for number in range(count):
        if time.monotonic() > until_s:
            break
        form, files = wholes[number % len(wholes)]
        read(form, mutated(files, rng), folder, findings)
        if (number + 1) % TOLD_EVERY == 0:
            tell(TOLD_EVERY)

    gc.collect()
    findings.growth_mb = max(0.0, rss_mb() - baseline_mb)
    return findings


@contextmanager
def _standard_error_to(path: Path) -> Iterator[None]:
    """Let decoders of pictures, which print a line for each error, print into a file."""
    shown = os.dup(STANDARD_ERROR)
    with path.open("wb") as file:
        os.dup2(file.fileno(), STANDARD_ERROR)
    try:
        yield
    finally:
        os.dup2(shown, STANDARD_ERROR)
        os.close(shown)


def mutated(files: Files, rng: random.Random) -> Files:
    """Return files of which one is another, or is missing."""
    name = rng.choice(sorted(files))
    other = files[rng.choice(sorted(files))]
    if len(files) > 1 and rng.random() < 0.01:
        return {each: content for each, content in files.items() if each != name}
    return {**files, name: changed(files[name], rng, other)}


def read(form: Format, files: Files, folder: Path, findings: Findings) -> None:
    """Write files into a new folder, and read them as the format's reader does."""
    place = folder / "read"
    shutil.rmtree(place, ignore_errors=True)
    for name, content in files.items():
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    findings.watch_memory(form.name, lambda: form.read(place / form.file))
