"""The targets of coverage-guided fuzzing, without it: each takes its corpus, and any bytes."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from benchmarks.fuzz.mutations import changed
from tests.fuzz.targets.__main__ import written
from tests.fuzz.targets.table import Target, targets

MUTATIONS = 5
TARGETS = targets()


@pytest.mark.parametrize("target", TARGETS.values(), ids=TARGETS.keys())
def test_a_target_takes_its_corpus_and_what_is_made_of_it(target: Target) -> None:
    rng = random.Random(1)
    corpus = target.corpus()
    assert corpus

    for content in [*corpus, b"", *(changed(corpus[0], rng) for _ in range(MUTATIONS))]:
        target.run(content)


def test_a_corpus_is_written_into_the_folder_of_its_target(tmp_path: Path) -> None:
    folder = written("message-clock", tmp_path)

    (sample,) = folder.iterdir()
    assert [sample.read_bytes()] == TARGETS["message-clock"].corpus()
