"""One run of an experiment through real processes on a real bus, as the demo's: it must say the
same bytes.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from cli.launch.plan import CONFIG_NAME, ROUTER, to_toml
from cli.launch.supervisor import Program, Supervisor, cogmap_command
from cogmap.bus.session import free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import CogmapError
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from experiments import transcript
from experiments.transcript import Transcript
from services import registry

PUMP_S = 0.005
PATIENCE_S = 60.0
GRACE_S = 3.0
AGENT = "agent"


def differing(sections: Sections, modules: Sequence[str]) -> list[str]:
    """The topics on which `modules` say other bytes as real processes than on the in-memory bus,
    where the simulation is one of them and leads its robot: nothing else has to be there.
    """
    awaits = {**sections["sim"]["awaits"], transcript.NAME: 1}
    sections = {**sections, "sim": {**sections["sim"], "awaits": awaits}}
    inside = Transcript(transcript.MODEL)
    outside = Transcript(transcript.MODEL)
    runner = InProcessRunner(
        [*(registry.build(name, sections) for name in modules), inside.module()]
    )
    runner.run()
    runner.close()
    run(
        sections,
        [(name, name) for name in modules],
        [outside.module()],
        lambda: outside.has_as_many_as(inside),
    )
    return outside.differs_from(inside)


def check(differing: Sequence[str]) -> None:
    """Raise CogmapError where topics differ: the command then ends with code 1, its figures
    written.
    """
    if differing:
        raise CogmapError(
            f"through real processes the run said other bytes on {', '.join(differing)}"
        )


def run(
    sections: Sections,
    minds: Sequence[tuple[str, str]],
    here: Sequence[Module],
    done: Callable[[], bool],
) -> None:
    """Run `minds` (module, instance) as processes, configured by `sections`, and the modules
    `here`, until `done`, or nothing was said for PATIENCE_S: what was not said by then is missing.
    """
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        endpoint = free_endpoint()
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
        while not done() and time.monotonic() < until_s:
            news = [shell.spin_once(PUMP_S) for shell in shells]
            if any(news):
                until_s = time.monotonic() + PATIENCE_S
            supervisor.check()


def _programs(folder: Path, endpoint: str, minds: Sequence[tuple[str, str]]) -> list[Program]:
    where = ["--tied", "--connect", endpoint]
    config = ["--agent", AGENT, "--config", str(folder / CONFIG_NAME)]
    router = cogmap_command("router", *where)
    programs = [Program(ROUTER, lambda starts: router)]
    for module, instance in minds:
        command = cogmap_command("module", module, "--instance", instance, *where, *config)
        programs.append(Program(instance, lambda starts, command=command: command))  # type: ignore[misc]
    return programs
