"""Workers that a person adds to a system, or kills, to see how it goes on."""

from __future__ import annotations

import subprocess
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
import tomli_w

from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.errors import UsageError
from cogmap.runtime.config import Sections

MODULE = "codelets"
KILL_TIMEOUT_S = 5.0


class Workers:
    """The workers of the system at `endpoint`. Those that were added end with this."""

    def __init__(self, endpoint: str, agent: str) -> None:
        self._endpoint = endpoint
        self._agent = agent
        self._folder = TemporaryDirectory(prefix="cogmap-workers-")
        self._numbers = count(1)
        self._added: dict[str, subprocess.Popen[bytes]] = {}

    def add(self, sections: Sections) -> str:
        """Start one more, with the settings of the others. Returns a sentence on what was done."""
        instance = f"{MODULE}-added-{next(self._numbers)}"
        places = ("--connect", self._endpoint, "--agent", self._agent)
        config_path = Path(self._folder.name) / f"{instance}.toml"
        given = {}
        for name, section in sections.items():
            given[name] = {key: value for key, value in section.items() if value is not None}
        config_path.write_text(tomli_w.dumps(given), encoding="utf-8")
        config = ("--config", str(config_path))
        command = cogmap_command(
            "module", MODULE, "--instance", instance, "--tied", *places, *config
        )
        self._added[instance] = subprocess.Popen(
            command, stdin=subprocess.PIPE, env=environment(), start_new_session=True
        )
        return f"{instance} starts"

    def kill(self, instance: str) -> str:
        """Kill a worker, as by `kill -9`. Returns a sentence on what was done. Raises UsageError if
        none of that name runs on this machine.
        """
        added = self._added.pop(instance, None)
        if added is not None:
            added.kill()
            added.wait()
            return f"{instance} is killed, and stays away"

        for process in psutil.process_iter(["cmdline"]):
            words = process.info["cmdline"] or []
            if all(word in words for word in (MODULE, instance, self._endpoint, self._agent)):
                process.kill()
                return f"{instance} is killed: whoever runs it starts it again"
        raise UsageError(f"no worker {instance!r} runs here: kill it on its own machine")

    def close(self) -> None:
        """End those that were added."""
        for process in self._added.values():
            process.terminate()
        for process in self._added.values():
            try:
                process.wait(KILL_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._folder.cleanup()
