"""What a run consists of: the configuration of every module, and the processes to start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import tomli_w

from cogmap.cli.files import LOG_NAME
from cogmap.cli.launch.command_line import cogmap_command
from cogmap.cli.launch.supervisor import Program
from cogmap.errors import ConfigError
from cogmap.runtime import config
from cogmap.runtime.config import Sections
from cogmap.schemas.nodes import Goal, goal_id
from cogmap.services import registry
from cogmap.services.sim.config import Config as SimConfig
from cogmap.services.sim.layout.town import generate
from cogmap.services.sim.layout.towns import BLOCKS, LOOP
from cogmap.services.sim.odometry import FUSED

OBSERVER = "observer"
RECORDER = "recorder"
ROUTER = "router"
START_FIRST = (ROUTER, "sim", RECORDER)
CONFIG_NAME = "config.toml"
STATE_NAME = "state"
MEMORY_NAME = "memory.db"
REPLICATED = "codelets"
MEMORY = "memory"
TOUR_TOWN_M = 120.0
TOUR_LIMIT_S = 600.0
EXPLORE_S = 150.0
HOME = Goal(id=goal_id("home"))
HOME_AFTER = 1.5
"""An agent may take so many times as long to its goals as it explored."""
LAP_S = 300.0
LAP_UNKNOWN_COST = 2.0
"""A lap leads along streets that are not known yet, where those that are known lead there too."""


@dataclass(frozen=True)
class Choices:
    """What the user chooses about a drive; None leaves it to the configuration.

    In the loop town the agent is given the corners of `laps` laps as goals, of one lap where that
    is None, unless it is given `goals`. On a `tour` it explores first; it is given `goals` then, or
    such as it knows. With `explore_s` it explores for so long, and then drives to `goals`, or home.
    With `energy` its battery runs down. `without` are the modules that somebody else starts.
    `own_router` is whether the run starts one. `memory` is the database of what was learned in
    earlier runs, a new one where it is None.
    """

    seed: int | None = None
    town: str | None = None
    laps: float | None = None
    lockstep: bool = False
    codelets: int = 1
    record: bool = True
    without: Sequence[str] = ()
    own_router: bool = True
    tour: bool = False
    explore_s: float | None = None
    goals: Sequence[Goal] = ()
    memory: Path | None = None
    energy: bool = False


def effective(base: Sections, choices: Choices, observer: bool) -> Sections:
    """The whole configuration of every module: `base`, the choices, the agent's first goals, and
    the default of every other key. Raises ConfigError.
    """
    config.check_sections(base, registry.sections())
    if choices.laps is not None and not _has_laps(base, choices):
        raise ConfigError(
            "--laps is of the loop town, and of a drive without goals of its own: leave it out"
        )

    chosen = _chosen(base, choices, observer)
    return {name: _complete(chosen, name) for name in registry.sections()}


def _has_laps(base: Sections, choices: Choices) -> bool:
    """Whether the agent's goals are the corners of the loop."""
    sim = base.get("sim", {})
    has_goals = choices.goals or choices.explore_s is not None or choices.tour
    is_given = has_goals or "goals" in base.get("workspace", {}) or "trajectory" in sim
    return not is_given and (choices.town or sim.get("town", LOOP)) == LOOP


def _chosen(base: Sections, choices: Choices, observer: bool) -> Sections:
    """Every section there may be, as in `base` where it is, with the choices in it."""
    sensing = base.get("sim", {}).get("sensing", "percepts")
    is_stepped = choices.lockstep or (choices.tour and sensing == "percepts")
    sections = {name: dict(base.get(name, {})) for name in registry.sections()}
    sections["run"].setdefault("lockstep", is_stepped)
    sections["run"].setdefault("participants", participants(choices, observer))
    sim = sections["sim"]
    if choices.seed is not None:
        sim["seed"] = choices.seed
    if choices.town is not None:
        sim["town"] = choices.town
    if choices.energy:
        sections["run"]["energy"] = True
    if choices.tour:
        _set_out(sim)
    if sim.get("sensing") == "percepts":
        sim.setdefault("noise", msgspec.to_builtins(FUSED))
    if "trajectory" not in sim:
        sections["planning"].setdefault("explore", True)
        if not choices.tour:
            _give_goals(sections, choices)
    return sections


def _give_goals(sections: Sections, choices: Choices) -> None:
    """The agent's goals, where there are any; the drive ends when they are reached.

    These are the goals that are chosen, after exploring else home; else those that are set, else
    the corners of the loop.
    """
    sim = sections["sim"]
    workspace = sections["workspace"]
    goals = choices.goals
    if choices.explore_s is not None:
        goals = goals or [HOME]
        workspace["goals_after_s"] = choices.explore_s
        sim.setdefault("duration_s", (1 + HOME_AFTER) * choices.explore_s)

    if goals:
        workspace["goals"] = [_given(goal) for goal in goals]
    elif "goals" not in workspace and sim.get("town", LOOP) == LOOP:
        laps = choices.laps or 1.0
        workspace["goals"] = _of_laps(sim.get("seed", SimConfig().seed), laps)
        workspace["in_order"] = True
        sections["planning"].setdefault("unknown_cost", LAP_UNKNOWN_COST)
        sim.setdefault("duration_s", max(SimConfig().duration_s, LAP_S * laps))

    if workspace.get("goals"):
        sim.setdefault("ends_at_goal", True)


def _given(goal: Goal) -> dict[str, Any]:
    """A goal as the workspace is configured with it."""
    name = goal.id.removeprefix(goal_id(""))
    return {"name": name, "object": goal.object, "x_m": goal.x_m, "y_m": goal.y_m}


def _of_laps(seed: int, laps: float) -> list[dict[str, Any]]:
    """The corners of the loop that so many laps lead past, and where they end."""
    *corners, end = generate(seed).goals(laps)
    places = [(f"corner {number}", place) for number, place in enumerate(corners, start=1)]
    places.append(("end", end))
    return [{"name": name, "x_m": x_m, "y_m": y_m} for name, (x_m, y_m) in places]


def _set_out(sim: dict[str, Any]) -> None:
    """The town and the time of a tour, as far as they are not set.

    It is sensed at the level of percepts, so that its minutes take seconds.
    """
    sim.setdefault("town", BLOCKS)
    sim.setdefault("sensing", "percepts")
    sim.setdefault("town_size_m", TOUR_TOWN_M)
    sim.setdefault("duration_s", TOUR_LIMIT_S)


def _complete(sections: Sections, name: str) -> dict[str, Any]:
    """The section of a module with every key that has a value."""
    kind = registry.config_type(name)
    typed = config.typed(sections, name, kind)

    complete: dict[str, Any] = {}
    for key, value in msgspec.to_builtins(typed).items():
        if value is not None:
            complete[key] = value
    return complete


def participants(choices: Choices, observer: bool) -> dict[str, int]:
    """How many instances of whom take part: every module, the workers, the recorder, and an
    `observer`.
    """
    members = dict.fromkeys(registry.MODULES, 1) | {REPLICATED: choices.codelets}
    if choices.record:
        members[RECORDER] = 1
    if observer:
        members[OBSERVER] = 1
    return members


def to_toml(sections: Sections) -> str:
    """`sections` as a TOML file that `config.load` reads back to the same."""
    return tomli_w.dumps(sections)


def programs(folder: Path, endpoint: str, agent: str, choices: Choices) -> list[Program]:
    """All processes of a run, in the order in which they are to be started: early what the others
    wait for, the simulation too, whose world takes long to build.
    """
    started = _infrastructure(folder, endpoint, agent, choices)
    started += _modules(folder, endpoint, agent, choices)
    return sorted(started, key=_start_order)


def _start_order(program: Program) -> int:
    instance = program.instance
    return START_FIRST.index(instance) if instance in START_FIRST else len(START_FIRST)


def _infrastructure(folder: Path, endpoint: str, agent: str, choices: Choices) -> list[Program]:
    """What carries and what records the messages."""
    programs = []
    if choices.own_router:
        router = cogmap_command("router", "--tied", "--connect", endpoint)
        programs.append(Program(ROUTER, lambda starts: router))

    def record(starts: int) -> list[str]:
        """A recorder that died leaves its log as it is, and the next one writes another."""
        name = LOG_NAME if starts == 0 else f"log-{starts + 1}.mcap"
        log = folder / name
        options = _options(folder, endpoint, agent)
        return cogmap_command("log", "record", *options, "-o", str(log))

    if choices.record:
        programs.append(Program(RECORDER, record))
    return programs


def _modules(folder: Path, endpoint: str, agent: str, choices: Choices) -> list[Program]:
    """Every module but those that somebody else starts, in the order of the table; they are held
    until what records them is there.
    """
    options = [*_options(folder, endpoint, agent), "--state", str(folder / STATE_NAME)]
    options += ["--memory", str(choices.memory or folder / MEMORY_NAME)]
    programs = []
    for name in registry.MODULES:
        if name in choices.without:
            continue
        for instance in _instances(name, choices):
            program = _module(name, instance, options)
            programs.append(program)
    return programs


def _options(folder: Path, endpoint: str, agent: str) -> list[str]:
    config_path = folder / CONFIG_NAME
    where = ["--tied", "--connect", endpoint, "--agent", agent]
    return [*where, "--config", str(config_path)]


def _instances(name: str, choices: Choices) -> list[str]:
    if name != REPLICATED:
        return [name]
    return [f"{name}-{number}" for number in range(1, choices.codelets + 1)]


def _module(name: str, instance: str, options: Sequence[str]) -> Program:
    command = cogmap_command("module", name, "--instance", instance, "--held", *options)
    return Program(instance, lambda starts: command, is_held=True)
