"""What a run consists of: the configuration of every module, and the processes to start."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from cli.launch.supervisor import Program, cogmap_command
from cogmap.runtime import config
from cogmap.runtime.config import Sections
from services import registry
from services.sim.layout.town import generate

OBSERVER = "observer"
RECORDER = "recorder"
ROUTER = "router"
LOG_NAME = "log.mcap"
CONFIG_NAME = "config.toml"
STATE_NAME = "state"


@dataclass(frozen=True)
class Choices:
    """What the user chooses about a drive; None leaves it to the configuration."""

    seed: int | None = None
    laps: float | None = None
    lockstep: bool = False
    codelets: int = 1
    record: bool = True


def effective(base: Sections, choices: Choices, awaits: dict[str, int]) -> Sections:
    """The whole configuration of every module: `base`, the choices, the route through the town, all
    defaults.

    The route is what a passenger would tell the agent: so many metres, a turn, and so on. Raises
    ConfigError.
    """
    config.check_sections(base, registry.MODULES)
    sections: Sections = {name: dict(base.get(name, {})) for name in registry.MODULES}
    sim = sections["sim"]
    sim |= {
        key: value
        for key, value in (("seed", choices.seed), ("laps", choices.laps))
        if value is not None
    }
    sim.setdefault("awaits", awaits)
    for name in ("sim", "workspace", "action"):
        sections[name].setdefault("mode", "lockstep" if choices.lockstep else "real_time")
    whole = {name: _whole(sections, name) for name in registry.MODULES}
    if not whole["action"]["route"]:
        town = generate(whole["sim"]["seed"])
        whole["action"]["route"] = [list(leg) for leg in town.route(whole["sim"]["laps"])]
    return whole


def _whole(sections: Sections, name: str) -> dict[str, Any]:
    settings: dict[str, Any] = msgspec.to_builtins(
        config.typed(sections, name, registry.config_type(name))
    )
    return {key: value for key, value in settings.items() if value is not None}


def everybody(choices: Choices, observer: bool) -> dict[str, int]:
    """Whom the simulator waits for: every other module, the workers, and whoever watches."""
    awaits = {name: 1 for name in registry.MODULES if name != "sim"} | {
        "codelets": choices.codelets
    }
    return awaits | ({RECORDER: 1} if choices.record else {}) | ({OBSERVER: 1} if observer else {})


def to_toml(sections: Sections) -> str:
    """`sections` as a TOML file that `config.load` reads back to the same."""
    return "\n".join(
        f"[{name}]\n"
        + "".join(f"{key} = {_toml_value(value)}\n" for key, value in settings.items())
        for name, settings in sections.items()
    )


def _toml_value(value: object) -> str:
    if isinstance(value, dict):
        return (
            "{ "
            + ", ".join(f"{json.dumps(key)} = {_toml_value(item)}" for key, item in value.items())
            + " }"
        )
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml_value(item) for item in value) + "]"
    return json.dumps(value)


def programs(
    folder: Path, connect: str, agent: str, choices: Choices
) -> tuple[list[Program], list[Program]]:
    """Every process of a run but the launcher: what carries and records the messages, then the
    modules.
    """
    where = ["--tied", "--connect", connect]
    whose = ["--agent", agent]
    config_file = ["--config", str(folder / CONFIG_NAME)]
    state = ["--state", str(folder / STATE_NAME)]

    def module(name: str, instance: str) -> Program:
        command = cogmap_command(
            "module", name, "--instance", instance, *where, *whose, *config_file, *state
        )
        return Program(instance, lambda starts: command)

    def record(starts: int) -> list[str]:
        """A recorder that died leaves its log as it is, and the next one writes another."""
        name = LOG_NAME if starts == 0 else f"log-{starts + 1}.mcap"
        return cogmap_command(
            "log", "record", *where, *whose, *config_file, "-o", str(folder / name)
        )

    workers = [f"codelets-{number}" for number in range(1, choices.codelets + 1)]
    named = [(name, name) for name in registry.MODULES if name != "codelets"] + [
        ("codelets", name) for name in workers
    ]
    router = Program(ROUTER, lambda starts: cogmap_command("router", *where))
    recorders = [Program(RECORDER, record)] if choices.record else []
    return [router, *recorders], [module(*each) for each in named]
