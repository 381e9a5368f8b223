"""The workspace is 100 ms away from the router: its cycles wait for their answers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.partition.link import Link, Quality
from cogmap.schemas.graph import Phase
from tests.support.system.live import Feeder, Witness
from tests.support.system.networks import working
from tests.support.system.processes import System, wait_until

SLOW = Quality(delay_s=0.1)
IN_A_ROW = 5


@pytest.fixture
def far(system: System, tmp_path: Path) -> Iterator[System]:
    """A system of which the router is that of `system`, behind a slow link."""
    system.router()
    link = Link(int(system.endpoint.rpartition(":")[2]), SLOW, seed=1)
    folder = tmp_path / "far"
    folder.mkdir()
    far = System(folder)
    far.endpoint = link.endpoint
    yield far
    far.close()
    link.close()


def _localized(witness: Witness) -> list[bool]:
    """Of each cycle that has ended, whether it has a localization."""
    ended = [delta.cycle for delta in witness.deltas if delta.phase is Phase.END]
    phase = Phase.LOCALIZATION
    localized = {delta.cycle for delta in witness.deltas if delta.phase is phase}
    return [cycle in localized for cycle in ended]


def _says_so(witness: Witness) -> bool:
    notes = witness.health["workspace"].notes
    return any("ms after their tasks" in note for note in notes)


def test_cycles_wait_for_answers_that_a_link_makes_late(system: System, far: System) -> None:
    system.modules("codelets-1", "codelets-2")
    far.modules("workspace")
    feeder = Feeder(system.bus())
    witness = Witness(system.bus())

    with working(witness.shell), working(feeder.shell):
        wait_until(
            lambda: _localized(witness)[-IN_A_ROW:] == [True] * IN_A_ROW,
            f"{IN_A_ROW} cycles in a row are localized",
        )
        wait_until(lambda: _says_so(witness), "the workspace says how late answers are")
