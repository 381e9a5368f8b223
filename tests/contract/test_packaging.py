"""Installed, all of Cogmap is the package `cogmap`: no other top-level name is taken."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.support.includes import ROOT
from tests.support.reference import REFERENCE

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
