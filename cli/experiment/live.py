"""One run of an experiment through real processes on a real bus: it must publish the same bytes."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from cogmap.bus.session import free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.launch.command_line import cogmap_command
from cogmap.cli.launch.plan import CONFIG_NAME, ROUTER, to_toml
from cogmap.cli.launch.supervisor import Program, Supervisor
from cogmap.cli.progress import bar
from cogmap.errors import CogmapError
from cogmap.experiments import transcript
from cogmap.experiments.transcript import Transcript
from cogmap.runtime.config import Sections
from cogmap.runtime.environment import without_keys
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.services import registry

SPIN_S = 0.005
TIMEOUT_S = 60.0
GRACE_S = 3.0
AGENT = "agent"
SAME = "live_same"


def differing(sections: Sections, modules: Sequence[str]) -> list[str]:
    """Find topics on which `modules` publish other bytes as processes than on the in-memory bus.

    The simulation is one of them and moves its robot itself, so nothing else has to be there.
    """
    participants = {**sections["run"]["participants"], transcript.NAME: 1}
    sections = {**sections, "run": {**sections["run"], "participants": participants}}
    inside = Transcript(transcript.MODEL)
    outside = Transcript(transcript.MODEL)

    built = [registry.build(name, sections) for name in modules]
    runner = InProcessRunner([*built, inside.module()])
    with bar("in one process"):
        runner.run()
    runner.close()

    instances = [(name, name) for name in modules]
    run(sections, instances, [outside.module()], lambda: outside.has_as_many_as(inside))
    return outside.differs_from(inside)


def check(differing: Sequence[str] | None) -> None:
    """Raise CogmapError if topics differ: the command then ends with code 1."""
    if differing:
        raise CogmapError(
            f"through real processes the run published other bytes on {', '.join(differing)}"
        )


def run(
    sections: Sections,
    instances: Sequence[tuple[str, str]],
    here: Sequence[Module],
    is_done: Callable[[], bool],
) -> None:
    """Run `instances` (module, instance) as processes, and the modules `here` in this one.

    Until `is_done`, or nothing was published for TIMEOUT_S: what was not published by then is
    missing.
    """
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        stack.enter_context(without_keys())
        folder = Path(name)
        endpoint = free_endpoint()
        (folder / CONFIG_NAME).write_text(to_toml(sections))

        supervisor = Supervisor(folder)
        stack.callback(lambda: supervisor.end(list(supervisor.children), GRACE_S))
        where = ["--tied", "--connect", endpoint]
        supervisor.start(Program.of(ROUTER, cogmap_command("router", *where)))
        config = ["--agent", AGENT, "--config", str(folder / CONFIG_NAME)]
        for module, instance in instances:
            command = cogmap_command("module", module, "--instance", instance, *where, *config)
            supervisor.start(Program.of(instance, command))

        shells = [Shell(module, ZenohBus(endpoint, AGENT), health=False) for module in here]
        for shell in shells:
            stack.callback(shell.close)
            shell.open()

        stack.enter_context(bar("through real processes"))
        until_s = time.monotonic() + TIMEOUT_S
        while not is_done() and time.monotonic() < until_s:
            had_work = [shell.spin_once(SPIN_S) for shell in shells]
            if any(had_work):
                until_s = time.monotonic() + TIMEOUT_S
            supervisor.check()
