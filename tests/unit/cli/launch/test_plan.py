"""What a run consists of: configuration and processes."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from cogmap.cli.goal import parsed
from cogmap.cli.launch.plan import (
    OBSERVER,
    RECORDER,
    ROUTER,
    Choices,
    effective,
    participants,
    programs,
    to_toml,
)
from cogmap.cli.launch.supervisor import Program
from cogmap.cli.run.options import LAP_LIMIT_S
from cogmap.errors import ConfigError
from cogmap.services import registry
from cogmap.services.sim.config import Config as SimConfig
from cogmap.services.sim.layout.town import generate


def configured(choices: Choices, **sections: dict[str, object]) -> dict[str, dict[str, Any]]:
    return effective(sections, choices, observer=True)


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


def positions_m(sections: dict[str, dict[str, Any]]) -> list[tuple[float, float]]:
    return [(goal["x_m"], goal["y_m"]) for goal in sections["workspace"]["goals"]]


def test_the_goals_of_a_drive_in_the_loop_are_its_corners_lap_by_lap() -> None:
    sections = configured(Choices(seed=3, laps=1.5))
    names = [goal["name"] for goal in sections["workspace"]["goals"]]

    assert sections["sim"]["seed"] == 3
    assert positions_m(sections) == generate(3).goals(1.5)
    assert names == [*(f"corner {number}" for number in range(1, 7)), "end"]
    assert sections["workspace"]["in_order"]
    assert sections["sim"]["ends_at_goal"]


def test_a_drive_of_many_laps_has_time_for_them() -> None:
    of_one = configured(Choices())["sim"]["duration_s"]
    of_thirty = configured(Choices(laps=30.0))["sim"]["duration_s"]

    assert of_thirty > 30 * LAP_LIMIT_S
    assert of_one == SimConfig().duration_s


def test_the_agent_is_given_the_goals_that_are_chosen_in_any_order() -> None:
    chosen = parsed(["inn", "3", "-4"])
    workspace = configured(Choices(goals=chosen))["workspace"]

    assert workspace["goals"] == [
        {"name": "inn", "object": "inn", "x_m": 0.0, "y_m": 0.0},
        {"name": "3,-4", "object": "", "x_m": 3.0, "y_m": -4.0},
    ]
    assert not workspace["in_order"]


def test_after_exploring_the_agent_drives_home_or_to_the_goals_that_are_chosen() -> None:
    home = configured(Choices(town="blocks", explore_s=40.0))
    inn = configured(Choices(town="blocks", explore_s=40.0, goals=parsed(["inn"])))

    assert home["workspace"]["goals_after_s"] == 40.0
    assert positions_m(home) == [(0.0, 0.0)]
    assert home["sim"]["ends_at_goal"]
    assert 80.0 < home["sim"]["duration_s"] <= 120.0
    assert [goal["object"] for goal in inn["workspace"]["goals"]] == ["inn"]


def test_goals_that_are_set_stay() -> None:
    given = {"name": "kiosk", "object": "", "x_m": 12.0, "y_m": 0.0}
    sections = configured(Choices(), workspace={"goals": [given]})

    assert sections["workspace"]["goals"] == [given]
    assert not sections["workspace"]["in_order"]
    assert sections["sim"]["ends_at_goal"]


@pytest.mark.parametrize(
    ("choices", "sim"),
    [
        (Choices(town="blocks"), {}),
        (Choices(tour=True), {}),
        (Choices(), {"trajectory": {"line_m": [[0.0, 0.0], [9.0, 0.0]], "landmarks": []}}),
    ],
    ids=["blocks", "tour", "trajectory"],
)
def test_elsewhere_the_agent_has_no_goals_at_its_start(
    choices: Choices, sim: dict[str, object]
) -> None:
    sections = configured(choices, sim=sim)

    assert sections["workspace"]["goals"] == []
    assert not sections["sim"]["ends_at_goal"]


def test_a_drive_is_in_real_time_unless_lockstep_is_chosen() -> None:
    assert not configured(Choices())["run"]["lockstep"]
    assert configured(Choices(lockstep=True))["run"]["lockstep"]


def test_energy_is_off_unless_it_is_chosen() -> None:
    assert not configured(Choices())["run"]["energy"]
    assert configured(Choices(energy=True))["run"]["energy"]


def test_the_drive_waits_for_every_module_every_worker_and_whoever_watches() -> None:
    members = configured(Choices(codelets=3))["run"]["participants"]

    assert members == {
        "sim": 1,
        "sensory": 1,
        "epam": 1,
        "workspace": 1,
        "codelets": 3,
        "global_workspace": 1,
        "memory": 1,
        "procedural": 1,
        "action": 1,
        "motor": 1,
        RECORDER: 1,
        OBSERVER: 1,
    }
    assert (
        participants(Choices(record=False), observer=False).keys().isdisjoint({RECORDER, OBSERVER})
    )


@pytest.mark.parametrize(
    ("choices", "sections"),
    [
        (Choices(laps=2.0, town="blocks"), {}),
        (Choices(laps=2.0), {"sim": {"town": "blocks"}}),
        (Choices(laps=2.0, tour=True), {}),
        (Choices(laps=2.0, explore_s=40.0), {}),
        (Choices(laps=2.0, goals=parsed(["inn"])), {}),
        (Choices(laps=2.0), {"workspace": {"goals": [{"name": "inn", "object": "inn"}]}}),
    ],
)
def test_laps_that_are_not_driven_are_refused(
    choices: Choices, sections: dict[str, dict[str, object]]
) -> None:
    with pytest.raises(ConfigError, match="--laps is for the loop town"):
        configured(choices, **sections)


def test_a_section_of_no_module_is_named() -> None:
    with pytest.raises(ConfigError, match=r"unknown section \[acton\]: did you mean 'action'\?"):
        configured(Choices(), acton={})


def started(folder: Path, choices: Choices) -> list[Program]:
    return programs(folder, "tcp/127.0.0.1:1", "agent", choices)


def instances(folder: Path, choices: Choices) -> set[str]:
    return {program.instance for program in started(folder, choices)}


def test_each_module_is_a_process_and_each_worker_one_more(tmp_path: Path) -> None:
    router, *names = [program.instance for program in started(tmp_path, Choices(codelets=2))]
    modules = set(registry.taking_part()) - {"codelets"}
    workers = {"codelets-1", "codelets-2"}

    assert router == ROUTER
    assert sorted(names) == sorted(modules | workers | {RECORDER})


def test_router_simulation_and_recorder_are_started_first(tmp_path: Path) -> None:
    names = [program.instance for program in started(tmp_path, Choices())]

    assert names[:3] == [ROUTER, "sim", RECORDER]


def test_a_recording_is_played_in_the_place_of_the_simulation(tmp_path: Path) -> None:
    choices = Choices(recording="kitti:/drives/07", speed=4.0)
    names = [program.instance for program in started(tmp_path, choices)]
    sections = configured(choices)

    assert names[:3] == [ROUTER, "player", RECORDER]
    assert "sim" not in names
    assert "sim" not in sections["run"]["participants"]
    assert sections["run"]["participants"]["player"] == 1
    assert sections["player"]["recording"] == "kitti:/drives/07"
    assert sections["player"]["speed"] == 4.0
    assert sections["workspace"]["goals"] == []
    assert sections["planning"]["explore"]


def test_no_module_joins_before_it_is_recorded(tmp_path: Path) -> None:
    every = started(tmp_path, Choices())
    free = {program.instance for program in every if not program.is_held}

    assert free == {ROUTER, RECORDER}


def test_modules_of_ones_own_are_not_started_and_waited_for(tmp_path: Path) -> None:
    choices = Choices(without=["epam", "codelets"], codelets=2)
    every = {*registry.taking_part(), RECORDER, ROUTER}

    members = participants(choices, observer=True)

    assert instances(tmp_path, choices) == every - {"epam", "codelets"}
    assert members["epam"] == 1
    assert members["codelets"] == 2


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


def test_a_tour_explores_for_as_long_as_is_chosen() -> None:
    usual = configured(Choices(tour=True))
    longer = configured(Choices(tour=True, explore_s=Choices().explores_s + 60.0))

    assert longer["sim"]["duration_s"] == usual["sim"]["duration_s"] + 60.0


@pytest.mark.parametrize("town", ["loop", "blocks"])
def test_a_tour_is_of_the_town_that_is_chosen(town: str) -> None:
    sections = configured(Choices(tour=True, town=town))

    assert sections["sim"]["town"] == town
    assert "goals" not in sections["workspace"] or not sections["workspace"]["goals"]


@pytest.mark.parametrize("seed", ["x", -1, 2**70, [1]])
def test_a_seed_that_is_none_is_named_before_a_town_is_made_of_it(seed: object) -> None:
    with pytest.raises(ConfigError, match=r"sim\.seed"):
        configured(Choices(), sim={"seed": seed})
