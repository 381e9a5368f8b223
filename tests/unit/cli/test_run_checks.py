"""What a drive cannot begin with is found before any process is started."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.cli.launch.plan import Choices, effective
from cogmap.cli.run.checks import check_inputs
from cogmap.errors import CogmapError, ConfigError, StorageError
from cogmap.runtime.state.database import Database
from tests.support.world.schemes import FOLLOW, HEADER, written


def _check(choices: Choices, **sections: dict[str, object]) -> None:
    check_inputs(effective(sections, choices, observer=True), choices)


def test_a_drive_that_can_begin_passes_and_no_database_is_made(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    schemes = written(tmp_path, HEADER + FOLLOW)

    _check(Choices(memory=path), procedural={"schemes": str(schemes)})

    assert not path.exists()


def test_a_database_that_is_whole_is_left_for_the_module(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    Database(path).close()
    before = path.read_bytes()

    _check(Choices(memory=path))

    Database(path).close()
    assert path.read_bytes() == before


def test_a_wrong_scheme_is_named_by_file_and_line(tmp_path: Path) -> None:
    path = written(tmp_path, HEADER + FOLLOW.replace("follow_plan", "folow_plan"))
    sections: dict[str, object] = {"schemes": str(path)}

    with pytest.raises(ConfigError, match=r"schemes\.toml:5: .* did you mean 'follow_plan'\?"):
        _check(Choices(), procedural=sections)

    _check(Choices(without=["procedural"]), procedural=sections)


def test_a_damaged_database_is_named(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    path.write_bytes(b"no database")

    with pytest.raises(StorageError, match=r"memory\.db"):
        _check(Choices(memory=path))

    _check(Choices(memory=path, without=["memory"]))


def test_an_extract_that_is_missing_is_named(tmp_path: Path) -> None:
    town = f"osm:{tmp_path / 'none.osm'}"

    with pytest.raises(CogmapError, match=r"there is no file .*none\.osm"):
        _check(Choices(town=town))

    _check(Choices(town=town, without=["sim"]))


def test_settings_of_the_simulation_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ConfigError, match="frame_hz is 7: choose one that divides"):
        _check(Choices(), sim={"frame_hz": 7})
