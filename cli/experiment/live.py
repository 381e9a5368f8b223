"""One run of an experiment through real processes on a real bus, as the demo's: it must say the same bytes."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from bus.config import Sections
from bus.errors import CogmapError
from bus.module import Module
from bus.session import free_endpoint
from bus.shell import Shell
from bus.zenoh_bus import ZenohBus
from cli.run.plan import CONFIG_NAME, ROUTER, to_toml
from cli.run.supervisor import Program, Supervisor, cogmap_command

PUMP_S = 0.005
PATIENCE_S = 120.0
GRACE_S = 3.0
AGENT = "agent"


def run(sections: Sections, minds: Sequence[tuple[str, str]], here: Sequence[Module], done: Callable[[], bool]) -> None:
    """Run `minds` (module, instance) as processes, configured by `sections`, and the modules `here`, until `done`.

    Raises CogmapError where that takes more than PATIENCE_S.
    """
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder, endpoint = Path(name), free_endpoint()
        (folder / CONFIG_NAME).write_text(to_toml(sections))
        supervisor = Supervisor(folder)
        stack.callback(lambda: supervisor.end(list(supervisor.children), GRACE_S))
        for program in _programs(folder, endpoint, minds):
            supervisor.start(program)
        shells = [Shell(module, ZenohBus(endpoint, AGENT), health=False) for module in here]
        for shell in shells:
            stack.callback(shell.close)
            shell.open()
        until_s = time.monotonic() + PATIENCE_S
        while not done():
            for shell in shells:
                shell.pump(PUMP_S)
            supervisor.check()
            if time.monotonic() > until_s:
                raise CogmapError(f"through real processes the run did not end within {PATIENCE_S:g} s")


def _programs(folder: Path, endpoint: str, minds: Sequence[tuple[str, str]]) -> list[Program]:
    where = ["--tied", "--connect", endpoint]
    config = ["--agent", AGENT, "--config", str(folder / CONFIG_NAME)]
    router = cogmap_command("router", *where)
    programs = [Program(ROUTER, lambda starts: router)]
    for module, instance in minds:
        command = cogmap_command("module", module, "--instance", instance, *where, *config)
        programs.append(Program(instance, lambda starts, command=command: command))  # type: ignore[misc]
    return programs
