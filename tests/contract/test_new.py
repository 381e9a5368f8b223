"""`cogmap new` writes codelets and modules that run, here and in packages of one's own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.includes import ROOT

TIMEOUT_S = 90.0
TREE = ("cogmap", "schemas", "services", "training", "experiments", "cli")
FILES = ("pyproject.toml", "compose.yaml")


def _run(folder: Path, *command: str, path: Path = ROOT) -> str:
    """What a command prints, run in a folder with the library of `path`. It has to succeed."""
    run = subprocess.run(
        [sys.executable, "-m", *command],
        check=False,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(path)])},
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


def _test(folder: Path, *paths: str, path: Path = ROOT) -> str:
    options = ["-q", "-c", "/dev/null", "--rootdir", ".", "-p", "no:cacheprovider"]
    return _run(folder, "pytest", *options, *paths, path=path)


def _new(folder: Path, kind: str, name: str, path: Path = ROOT) -> str:
    return _run(folder, "cogmap.cli.main", "new", kind, name, path=path)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of this source tree, with a new codelet and a new module in it."""
    folder = tmp_path_factory.mktemp("tree")
    names = [str(ROOT / name) for name in (*TREE, *FILES)]
    subprocess.run(["cp", "--archive", *names, str(folder)], check=True)
    _new(folder, "codelet", "street_lamp", folder)
    _new(folder, "module", "watch_dog", folder)
    return folder


def test_a_new_codelet_of_this_tree_runs(tree: Path) -> None:
    _test(tree, "tests/unit/codelets/test_street_lamp.py", path=tree)

    settings = _run(tree, "cogmap.cli.main", "config", path=tree)
    assert "[street_lamp]" in settings


def test_a_new_module_of_this_tree_runs(tree: Path) -> None:
    _test(tree, "tests/unit/watch_dog", path=tree)

    settings = _run(tree, "cogmap.cli.main", "config", path=tree)
    assert "[watch_dog]" in settings
    assert '"cogmap.services.watch_dog",' in (tree / "pyproject.toml").read_text()
    assert "command: module watch_dog" in (tree / "compose.yaml").read_text()


def test_what_is_written_into_this_tree_has_its_style(tree: Path) -> None:
    new = ["services/codelets", "services/watch_dog", "services/registry.py", "tests"]

    _run(tree, "ruff", "check", *new)
    _run(tree, "ruff", "format", "--check", *new)


def test_a_codelet_in_a_package_of_its_own_runs_once_installed(tmp_path: Path) -> None:
    _new(tmp_path, "codelet", "street_lamp")
    package = tmp_path / "street_lamp"

    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation"]
    _run(tmp_path, "pip", "install", *options, "--target", "site", str(package))

    site = tmp_path / "site"
    _test(site, str(package / "test_street_lamp.py"))


def test_a_module_in_a_package_of_its_own_runs(tmp_path: Path) -> None:
    _new(tmp_path, "module", "watch_dog")

    _test(tmp_path / "watch_dog", "test_watch_dog.py")


@pytest.mark.parametrize("name", ["Street", "2nd", "a-b"])
def test_a_name_that_python_does_not_take_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="is no name"):
        _new(tmp_path, "codelet", name)


def test_what_is_there_is_not_written_over(tmp_path: Path) -> None:
    _new(tmp_path, "codelet", "street_lamp")

    with pytest.raises(AssertionError, match="is there already"):
        _new(tmp_path, "codelet", "street_lamp")
