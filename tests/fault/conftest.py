"""A system of processes for each test, with nothing left of it afterwards."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cogmap.bus.session import check_free
from tests.support.system.live import Feeder, Witness
from tests.support.system.networks import working
from tests.support.system.processes import System, shared_memory


@pytest.fixture
def system(tmp_path: Path) -> Iterator[System]:
    before = shared_memory()
    system = System(tmp_path)
    yield system
    system.close()
    assert not any(process.is_alive for process in system.processes.values())
    assert shared_memory() <= before
    check_free(system.endpoint)


@pytest.fixture
def agent(
    request: pytest.FixtureRequest, system: System
) -> Iterator[tuple[System, Feeder, Witness]]:
    """The workspace and two workers, with the settings in the fixture's parameter, fed and
    followed.
    """
    settings = getattr(request, "param", ())
    system.router()
    system.modules("workspace", "codelets-1", "codelets-2", settings=settings)
    feeder = Feeder(system.bus())
    witness = Witness(system.bus())
    with working(witness.shell), working(feeder.shell):
        witness.await_cycles(3)
        yield system, feeder, witness
