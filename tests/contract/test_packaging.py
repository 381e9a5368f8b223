"""Installed, all of Cogmap is the package `cogmap`: no other top-level name is taken."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.support.includes import ROOT
from tests.support.reference import REFERENCE

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
SUBPACKAGES = ("schemas", "services", "training", "experiments", "cli")


def test_the_wheel_holds_one_package_with_all_parts_in_it(tmp_path: Path) -> None:
    # The build writes beside the sources, so it gets sources of its own.
    sources = tmp_path / "sources"
    listed = ["requirements", "pyproject.toml", "cogmap", *SUBPACKAGES]
    sources.mkdir()
    subprocess.run(
        ["cp", "--archive", *(str(ROOT / name) for name in listed), str(sources)], check=True
    )
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*build, "--wheel-dir", str(tmp_path), str(sources)], check=True)

    (wheel,) = tmp_path.glob("cogmap-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    top_level = {name.partition("/")[0] for name in names if ".dist-info/" not in name}
    assert top_level == {"cogmap"}
    for part in SUBPACKAGES:
        assert f"cogmap/{part}/__init__.py" in names
    assert "cogmap/services/procedural/schemes.toml" in names


@pytest.mark.parametrize("name", SUBPACKAGES)
def test_a_module_of_the_users_with_a_name_of_a_part_breaks_nothing(
    name: str, tmp_path: Path
) -> None:
    (tmp_path / f"{name}.py").write_text("raise ImportError('of the user')\n")
    program = (
        f"import cogmap; log = cogmap.open_log({str(REFERENCE)!r})\n"
        "from cogmap.services import registry; print(registry.build('motor', {}).name)"
    )

    run = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )

    assert run.returncode == 0, run.stderr
    assert run.stdout == "motor\n"


def _pins(*names: str) -> dict[str, Requirement]:
    """The requirements in these files of requirements/, by package."""
    pinned = {}
    for name in names:
        for line in (ROOT / "requirements" / f"{name}.txt").read_text().splitlines():
            if line and not line.startswith(("-r", "#")):
                requirement = Requirement(line)
                pinned[requirement.name] = requirement
    return pinned


def _ranges(*extras: str) -> dict[str, Requirement]:
    """What the library requires, or these extras of it, by package."""
    lines = [] if extras else PROJECT["dependencies"]
    for extra in extras:
        lines = lines + PROJECT["optional-dependencies"][extra]
    return {requirement.name: requirement for requirement in map(Requirement, lines)}


def test_the_library_requires_ranges_and_the_application_one_version_within_each() -> None:
    ranges = _ranges() | _ranges("rendering", "train")
    pins = _pins("run", "train")

    assert pins.keys() == ranges.keys()
    for name, pin in pins.items():
        (version,) = pin.specifier
        assert version.operator == "=="
        assert version.version in ranges[name].specifier, name
        assert not any(each.operator == "==" for each in ranges[name].specifier), name
        assert pin.marker == ranges[name].marker, name


def test_what_renders_trains_makes_tables_or_shows_is_optional() -> None:
    tables = _ranges("tables")
    (tested,) = _pins("dev")["pyarrow"].specifier

    recordings = _ranges("recordings")
    (read,) = _pins("dev")["pynwb"].specifier

    assert recordings.keys() == {"pynwb"}
    assert read.version in recordings["pynwb"].specifier
    assert _ranges("rerun").keys() == _pins("rerun").keys()
    assert tables.keys() == {"pyarrow"}
    assert tested.version in tables["pyarrow"].specifier
    assert _ranges("rendering").keys() == {"pybullet"}
    assert _ranges("train").keys() == _pins("train").keys()


def test_the_build_of_the_package_uses_the_pinned_setuptools() -> None:
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]

    assert build["requires"] == [str(_pins("build")["setuptools"])]


def test_the_notices_name_every_dependency_with_its_licence() -> None:
    notices = (ROOT / "docs" / "third-party.md").read_text()
    rows = re.findall(r"^\| ([\w-]+) \| ([^|]+) \| [^|]+ \|$", notices, re.MULTILINE)

    named = {name: licence for name, licence in rows if name != "package"}
    pinned = _pins("run", "train", "bench", "build", "dev", "rerun", "docs", "audit")
    assert named.keys() == pinned.keys()
    assert all(licence.strip() for licence in named.values())
