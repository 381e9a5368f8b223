"""The fuzzing campaign in short: no mutated message and no file ends a process or fills it."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from benchmarks.fuzz import files, messages
from benchmarks.fuzz.readers import Format, formats
from benchmarks.fuzz.watch import Findings

MESSAGES = 400
OF_EACH_FORMAT = 12


def test_mutated_messages_end_no_module() -> None:
    told: list[int] = []

    found = messages.campaign("short", MESSAGES, time.monotonic() + 600.0, told.append)

    assert not found.crashes
    assert found.tried == MESSAGES == sum(told)
    assert found.handled
    assert found.refused


@pytest.mark.parametrize("form", formats().values(), ids=lambda form: form.name)
def test_samples_are_read_and_what_is_made_of_them_is_refused_by_a_sentence(
    form: Format, tmp_path: Path
) -> None:
    sample = form.sample()
    whole = Findings()
    files.read(form, sample, tmp_path, whole)
    assert not whole.refused
    assert not whole.crashes

    rng = random.Random(form.name)
    found = Findings()
    for _ in range(OF_EACH_FORMAT):
        files.read(form, files.mutated(sample, rng), tmp_path, found)

    assert not found.crashes
    assert not found.over_bound


def test_a_reader_that_fails_by_an_error_of_another_kind_is_a_crash(tmp_path: Path) -> None:
    def broken(path: Path) -> None:
        raise KeyError(path.name)

    found = Findings()
    files.read(Format("broken", dict, ".", broken), {"a": b""}, tmp_path, found)

    assert sum(found.crashes.values()) == 1
