"""Plans a run: the configuration of every module, and the processes to start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import tomli_w

from cogmap.cli.launch.command_line import cogmap_command
from cogmap.cli.launch.goals import name_of
from cogmap.cli.launch.supervisor import Program
from cogmap.errors import ConfigError
from cogmap.recording.storage.format import LOG_NAME
from cogmap.runtime import config
from cogmap.runtime.config import Sections
from cogmap.schemas.nodes import Goal, goal_id
from cogmap.services import registry
from cogmap.services.sim.config import Config as SimConfig
from cogmap.services.sim.layout.town import generate
from cogmap.services.sim.layout.towns import BLOCKS, LOOP, is_written
from cogmap.services.sim.odometry import FUSED

OBSERVER = "observer"
RECORDER = "recorder"
DASHBOARD = "dashboard"
ROUTER = "router"
START_FIRST = (ROUTER, *registry.BODIES, RECORDER)
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
"""How many times as long as it explored an agent may take to its goals."""
LAP_S = 300.0
LAP_UNKNOWN_COST = 2.0
"""A lap leads along unknown streets too, though known ones may lead to the same corner."""


@dataclass(frozen=True)
class Choices:
    """What the user chooses about a drive; None leaves it to the configuration.

    In the loop town the agent is given the corners of `laps` laps as goals, of one lap where that
    is None, unless it is given `goals`. On a `tour` it explores first; it is given `goals` then, or
    such as it knows. With `explore_s` it explores for so long, and then drives to `goals`, or home.
    With `energy` its battery runs down. `without` are the modules that somebody else starts.
    `own_router` is whether the run starts one. `memory` is the database of what was learned in
    earlier runs, a new one where it is None. `recording`, FORMAT:PATH, is played in the place of
    the simulation, `speed` times as fast as it was recorded. With a `dashboard` a browser can
    watch; one is opened if it `opens_dashboard`.
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
    recording: str = ""
    speed: float | None = None
    dashboard: bool = False
    opens_dashboard: bool = False

    @property
    def modules(self) -> tuple[str, ...]:
        """Return the modules that take part."""
        return registry.taking_part(registry.PLAYER if self.recording else registry.SIM)

    @property
    def explores_s(self) -> float:
        """Return how long the agent explores on a tour."""
        return EXPLORE_S if self.explore_s is None else self.explore_s


def effective(base: Sections, choices: Choices, observer: bool) -> Sections:
    """Make the whole configuration of every module: `base`, the choices, the agent's first goals,
    and the default of every other key. Raises ConfigError.
    """
    config.check_sections(base, registry.sections())
    for name in base:
        config.typed(base, name, registry.config_type(name))
    if choices.laps is not None and not _has_laps(base, choices):
        raise ConfigError(
            "--laps is for the loop town, and a drive without goals of its own: leave it out"
        )

    chosen = _chosen(base, choices, observer)
    complete: Sections = {}
    for name in chosen:
        typed = config.typed(chosen, name, registry.config_type(name))
        values: dict[str, Any] = msgspec.to_builtins(typed)
        complete[name] = {key: value for key, value in values.items() if value is not None}
    return complete


def _has_laps(base: Sections, choices: Choices) -> bool:
    """Decide whether the agent's goals are the corners of the loop."""
    if choices.recording:
        return False

    sim = base.get("sim", {})
    has_goals = choices.goals or choices.explore_s is not None or choices.tour
    is_given = has_goals or "goals" in base.get("workspace", {}) or "trajectory" in sim
    return not is_given and (choices.town or sim.get("town", LOOP)) == LOOP


def _chosen(base: Sections, choices: Choices, observer: bool) -> Sections:
    """Return every section there may be, as in `base` if it is there, with the choices in it."""
    sensing = base.get("sim", {}).get("sensing", "percepts")
    is_stepped = choices.lockstep or (choices.tour and sensing == "percepts")
    sections = {name: dict(base.get(name, {})) for name in registry.sections()}
    sections["run"].setdefault("lockstep", is_stepped)
    sections["run"].setdefault("participants", participants(choices, observer))
    if choices.energy:
        sections["run"]["energy"] = True

    if choices.recording:
        _give_recording(sections, choices)
        return sections

    sim = sections["sim"]
    if choices.seed is not None:
        sim["seed"] = choices.seed
    if choices.town is not None:
        sim["town"] = choices.town
    if choices.tour:
        longer_s = choices.explores_s - EXPLORE_S
        sim.setdefault("town", BLOCKS)
        sim.setdefault("sensing", "percepts")  # so that its minutes take seconds
        sim.setdefault("town_size_m", TOUR_TOWN_M)
        sim.setdefault("duration_s", TOUR_LIMIT_S + longer_s)
    if sim.get("sensing") == "percepts":
        sim.setdefault("noise", msgspec.to_builtins(FUSED))
    if "trajectory" not in sim:
        sections["planning"].setdefault("explore", True)
        if not choices.tour:
            _give_goals(sections, choices)
    return sections


def _give_recording(sections: Sections, choices: Choices) -> None:
    """Name what is to be played. The agent explores, though nothing that it does moves anything."""
    player = sections["player"]
    player["recording"] = choices.recording
    if choices.speed is not None:
        player["speed"] = choices.speed
    sections["planning"].setdefault("explore", True)


def _give_goals(sections: Sections, choices: Choices) -> None:
    """Give the agent its goals, if there are any; the drive ends when they are reached.

    These are the goals that are chosen, after exploring else home; else those that are set, else
    those of a town that somebody has written, or the corners of the loop.
    """
    sim = sections["sim"]
    workspace = sections["workspace"]
    goals = choices.goals
    if choices.explore_s is not None:
        goals = goals or [HOME]
        workspace["goals_after_s"] = choices.explore_s
        sim.setdefault("duration_s", (1 + HOME_AFTER) * choices.explore_s)

    if goals:
        workspace["goals"] = [
            {"name": name_of(goal.id), "object": goal.object, "x_m": goal.x_m, "y_m": goal.y_m}
            for goal in goals
        ]
    elif "goals" not in workspace and is_written(sim.get("town", LOOP)):
        workspace["goals"] = _written_goals(Path(sim["town"]))
    elif "goals" not in workspace and sim.get("town", LOOP) == LOOP:
        laps = choices.laps or 1.0
        *corners, end = generate(sim.get("seed", SimConfig().seed)).goals(laps)
        places = [(f"corner {number}", place) for number, place in enumerate(corners, start=1)]
        workspace["goals"] = [
            {"name": name, "x_m": x_m, "y_m": y_m} for name, (x_m, y_m) in [*places, ("end", end)]
        ]
        workspace["in_order"] = True
        sections["planning"].setdefault("unknown_cost", LAP_UNKNOWN_COST)
        sim.setdefault("duration_s", max(SimConfig().duration_s, LAP_S * laps))

    if workspace.get("goals"):
        sim.setdefault("ends_at_goal", True)


def _written_goals(path: Path) -> list[dict[str, Any]]:
    """Return the goals of a town that somebody has written. Raises ConfigError.

    The agent has to find a building itself: it is given the name alone.
    """
    from cogmap.services.sim.layout.written import town as written  # few drive there

    return [
        {"name": goal.name, "object": goal.building}
        if goal.building
        else {"name": goal.name, "x_m": goal.x_m, "y_m": goal.y_m}
        for goal in written.read(path).goals
    ]


def participants(choices: Choices, observer: bool) -> dict[str, int]:
    """Count the instances that take part, by name: every module, the workers, the recorder, and an
    `observer`.
    """
    members = dict.fromkeys(choices.modules, 1) | {REPLICATED: choices.codelets}
    if choices.record:
        members[RECORDER] = 1
    if observer:
        members[OBSERVER] = 1
    return members


def to_toml(sections: Sections) -> str:
    """Format `sections` as a TOML file that `config.load` reads back to the same."""
    return tomli_w.dumps(sections)


def programs(folder: Path, endpoint: str, agent: str, choices: Choices) -> list[Program]:
    """List all processes of a run but those that somebody else starts, in the order in which to
    start them: first what the others wait for, and the simulation, whose world takes long to build.

    Modules are held until what records them is there.
    """
    found = []
    if choices.own_router:
        router = cogmap_command("router", "--tied", "--connect", endpoint)
        found.append(Program.of(ROUTER, router))

    config_path = str(folder / CONFIG_NAME)
    options = ["--tied", "--connect", endpoint, "--agent", agent, "--config", config_path]

    def record(starts: int) -> list[str]:
        """Return a recorder's command. One that died leaves its log; the next continues it in
        another.
        """
        names = [LOG_NAME, *(f"log-{number}.mcap" for number in range(2, starts + 2))]
        *earlier, path = (str(folder / name) for name in names)
        continued = [word for log in earlier for word in ("--after", log)]
        return cogmap_command("log", "record", *options, "-o", path, *continued)

    if choices.record:
        found.append(Program(RECORDER, record))

    memory = str(choices.memory or folder / MEMORY_NAME)
    kept = ["--state", str(folder / STATE_NAME), "--memory", memory]
    for name in choices.modules:
        if name in choices.without:
            continue
        instances = [name]
        if name == REPLICATED:
            instances = [f"{name}-{number}" for number in range(1, choices.codelets + 1)]
        for instance in instances:
            command = cogmap_command(
                "module", name, "--instance", instance, "--held", *options, *kept
            )
            found.append(Program.of(instance, command, is_held=True))

    first = [program for name in START_FIRST for program in found if program.instance == name]
    return [*first, *(program for program in found if program not in first)]


def dashboard(endpoint: str, agent: str, port: int, opens: bool) -> Program:
    """Return the process that serves the dashboard at `port`."""
    options = ["--tied", "--connect", endpoint, "--agent", agent, "--port", str(port)]
    if opens:
        options.append("--open")
    command = cogmap_command("dashboard", *options)
    return Program(DASHBOARD, lambda _starts: command, is_needed=False)
