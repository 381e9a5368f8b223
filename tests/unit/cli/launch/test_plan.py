"""What a run consists of: configuration and processes."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest

from cli.launch.plan import (
    OBSERVER,
    RECORDER,
    ROUTER,
    Choices,
    awaited,
    effective,
    infrastructure,
    modules,
    to_toml,
)
from cli.launch.supervisor import Program
from cogmap.errors import ConfigError
from services import registry
from services.sim.layout.town import generate


def configured(choices: Choices, **sections: dict[str, object]) -> dict[str, dict[str, object]]:
    return effective(sections, choices, awaited(choices, observer=True))


def test_the_configuration_reads_back_from_toml_to_the_same() -> None:
    sections = configured(Choices(seed=7), epam={}, workspace={"cell_m": 0.5})
    read = tomllib.loads(to_toml(sections))

    assert read == sections
    assert sections["workspace"]["cell_m"] == 0.5


def test_every_module_gets_its_whole_configuration() -> None:
    sections = configured(Choices())
    assert list(sections) == list(registry.sections())

    for name, section in sections.items():
        config = registry.config_type(name)()
        keys = set(config.__struct_fields__)
        unset = {key for key in keys if getattr(config, key) is None}
        assert set(section) == keys - unset


def test_the_route_is_that_of_the_town_and_the_laps() -> None:
    sections = configured(Choices(seed=3, laps=1.5))
    route = generate(3).route(1.5)

    assert sections["action"]["route"] == [list(leg) for leg in route]
    assert sections["sim"]["seed"] == 3
    assert sections["sim"]["laps"] == 1.5


def test_a_route_of_ones_own_stays() -> None:
    assert configured(Choices(), action={"route": [[12.0, 0.0]]})["action"]["route"] == [
        (12.0, 0.0)
    ]


def test_lockstep_is_the_mode_of_all_that_have_one() -> None:
    sections = configured(Choices(lockstep=True))

    for name in ("sim", "workspace", "action"):
        assert sections[name]["mode"] == "lockstep"


def test_the_drive_waits_for_every_module_every_worker_and_whoever_watches() -> None:
    awaits = configured(Choices(codelets=3))["sim"]["awaits"]

    assert awaits == {
        "sensory": 1,
        "epam": 1,
        "workspace": 1,
        "codelets": 3,
        "global_workspace": 1,
        "action": 1,
        RECORDER: 1,
        OBSERVER: 1,
    }
    assert awaited(Choices(record=False), observer=False).keys().isdisjoint({RECORDER, OBSERVER})


def test_a_section_of_no_module_is_named() -> None:
    with pytest.raises(ConfigError, match=r"unknown section \[acton\]: did you mean 'action'\?"):
        configured(Choices(), acton={})


def started(folder: Path, choices: Choices) -> list[Program]:
    where = (folder, "tcp/127.0.0.1:1", "agent", choices)
    return [*infrastructure(*where), *modules(*where)]


def instances(folder: Path, choices: Choices) -> set[str]:
    return {program.instance for program in started(folder, choices)}


def test_each_module_is_a_process_and_each_worker_one_more(tmp_path: Path) -> None:
    router, *names = [program.instance for program in started(tmp_path, Choices(codelets=2))]
    modules = set(registry.MODULES) - {"codelets"}
    workers = {"codelets-1", "codelets-2"}

    assert router == ROUTER
    assert sorted(names) == sorted(modules | workers | {RECORDER})


def test_modules_of_ones_own_are_not_started_and_waited_for(tmp_path: Path) -> None:
    choices = Choices(without=["epam", "codelets"], codelets=2)
    every = {*registry.MODULES, RECORDER, ROUTER}

    awaits = awaited(choices, observer=True)

    assert instances(tmp_path, choices) == every - {"epam", "codelets"}
    assert awaits["epam"] == 1
    assert awaits["codelets"] == 2


def test_an_existing_router_is_used_and_none_started(tmp_path: Path) -> None:
    choices = Choices(own_router=False)

    assert ROUTER not in instances(tmp_path, choices)


def test_a_recorder_that_is_started_again_writes_another_log(tmp_path: Path) -> None:
    every = started(tmp_path, Choices())
    (recorder,) = [program for program in every if program.instance == RECORDER]

    first = str(tmp_path / "log.mcap")
    second = str(tmp_path / "log-2.mcap")

    assert first in recorder.command(0)
    assert second in recorder.command(1)


def test_toml_keeps_every_character_and_infinity() -> None:
    town = '\U0001f3e0 "\\ \x7f é'
    sections = {"sim": {"town": town, "limit": math.inf, "list": [-math.inf]}}
    read = tomllib.loads(to_toml(sections))

    assert read == sections
