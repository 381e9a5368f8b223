"""The disk of a module's state is full."""

from __future__ import annotations

from tests.support.system.disks import full_after
from tests.support.system.live import Feeder
from tests.support.system.networks import working
from tests.support.system.processes import System, wait_until

FULL_BYTES = 20_000
USAGE_EXIT = 2


def test_a_workspace_that_cannot_write_its_journal_ends_with_a_sentence(system: System) -> None:
    system.router()
    with full_after(FULL_BYTES):
        (workspace,) = system.modules("workspace")
    system.modules("codelets-1")
    feeder = Feeder(system.bus())

    with working(feeder.shell):
        wait_until(lambda: not workspace.is_alive, "the workspace ends")

    assert workspace.exit_code == USAGE_EXIT
    last = workspace.lines()[-1]
    assert last.startswith("cogmap: cannot write ")
    assert last.endswith("make room on its disk, or name another folder with --state")
