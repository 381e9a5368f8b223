"""`cogmap new`: a first version of a codelet or a module, with its test and where it is named."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from string import Template

import click

from cogmap.cli.new.rows import Row, at_end_of, before, in_list
from cogmap.errors import UsageError

TEMPLATES = Path(__file__).parent / "templates"
PROJECT_MARK = Path("services") / "registry.py"
PUBLIC_IMPORTS = {
    "codelet": "from cogmap import Answer, Codelet, CycleContext, Graph",
    "module": "from cogmap import Graph, MessageError, Module, run_program, topics",
    "module_test": "from cogmap import MessageError",
}
OWN_IMPORTS = {
    "codelet": (
        "from cogmap.graph.graph import Graph\n"
        "from cogmap.runtime.codelet import Answer, Codelet, CycleContext"
    ),
    "module": (
        "from cogmap.errors import MessageError\n"
        "from cogmap.graph.graph import Graph\n"
        "from cogmap.runtime.module import Module\n"
        "from cogmap.schemas import topics"
    ),
    "module_test": "from cogmap.errors import MessageError",
}
TEST_IMPORTS = {
    "codelet": (
        "from cogmap.testing import Town, context, graph_of, percept, percepts, run_codelet",
        "CODELET, NAME, Config",
    ),
    "module": ("from cogmap.testing import Town, range_scan", "NAME, Config, build"),
}
MAIN = """

if __name__ == "__main__":
    run_program(build, Config, NAME)
"""


@click.group()
def new() -> None:
    """Write a first version of a codelet or a module.

    In Cogmap's own source tree: the file, its test, and its rows in the tables. Elsewhere: a
    package of its own, in a folder NAME, to install beside Cogmap. It runs as it is;
    CONTRIBUTING.md and docs/modules.md explain what to change.
    """


@new.command()
@click.argument("name")
def codelet(name: str) -> None:
    """Write a codelet with its settings."""
    _check(name)
    if _is_project():
        _write_project_codelet(name)
        _announce(f"[{name}] has its settings; python -m pytest tests/unit/codelets/test_{name}.py")
        return

    values = {
        "imports": PUBLIC_IMPORTS["codelet"],
        "imported": _test_imports("codelet", name),
    }
    entry = f'[project.entry-points."cogmap.codelets"]\n{name} = "{name}:CODELET"'
    _write_package(name, "codelet", values, entry)
    _announce(f"pip install ./{name}, then cogmap run: [{name}] has its settings")


@new.command()
@click.argument("name")
def module(name: str) -> None:
    """Write a module, which takes part beside ours."""
    _check(name)
    class_name = "".join(word.capitalize() for word in name.split("_"))
    if _is_project():
        _write_project_module(name, class_name)
        _announce(
            f"python -m pytest tests/unit/{name}; then cogmap architecture, and record the "
            "reference anew (CONTRIBUTING.md, Generated files)"
        )
        return

    config = _filled("config", {"name": name})
    values = {
        "imports": PUBLIC_IMPORTS["module"],
        "test_imports": PUBLIC_IMPORTS["module_test"],
        "config_imports": "from typing import Annotated\n\nimport msgspec",
        "config": f"\n\n{config}\n",
        "class_name": class_name,
        "imported": _test_imports("module", name),
        "main": MAIN,
    }
    _write_package(name, "module", values, "")
    _announce(f"pip install ./{name}, then python -m {name} beside cogmap run")


def _check(name: str) -> None:
    """Raise UsageError if `name` cannot name a codelet or a module."""
    if not re.fullmatch("[a-z][a-z0-9_]*", name):
        raise UsageError(f"{name!r} is no name: use a to z, 0 to 9 and _, beginning with a letter")


def _is_project() -> bool:
    return PROJECT_MARK.exists() and Path("cogmap").is_dir()


def _test_imports(kind: str, path: str) -> str:
    """Make the last import lines of a test, in the order that ruff has them in."""
    harness, names = TEST_IMPORTS[kind]
    return "\n".join(sorted([harness, f"from {path} import {names}"]))


def _write_package(name: str, kind: str, values: Mapping[str, str], entry: str) -> None:
    """Write a package of one file with its test."""
    values = {**values, "name": name, "distribution": name.replace("_", "-"), "entry": entry}
    folder = Path(name)
    files = {
        folder / "pyproject.toml": re.sub("\n{3,}", "\n\n", _filled("pyproject", values)),
        folder / f"{name}.py": _filled(kind, values),
        folder / f"test_{name}.py": _filled(f"{kind}_test", values),
    }
    _write(files, [])


def _write_project_codelet(name: str) -> None:
    path = f"cogmap.services.codelets.{name}"
    values = {
        "name": name,
        "imports": OWN_IMPORTS["codelet"],
        "imported": _test_imports("codelet", path),
    }
    codelets = Path("services") / "codelets"
    files = {
        codelets / f"{name}.py": _filled("codelet", values),
        Path("tests/unit/codelets") / f"test_{name}.py": _filled("codelet_test", values),
    }
    _write(files, [at_end_of(codelets / "table.py", "ROWS = (", f'    Row("{name}", "{name}"),')])


def _write_project_module(name: str, class_name: str) -> None:
    path = f"cogmap.services.{name}"
    values = {
        "name": name,
        "class_name": class_name,
        "imports": OWN_IMPORTS["module"],
        "test_imports": OWN_IMPORTS["module_test"],
        "config_imports": "",
        "config": f"from {path}.config import Config\n",
        "main": "",
        "imported": _test_imports("module", f"{path}.module"),
    }
    code = _filled("module", values).replace("annotations\n\n\nimport", "annotations\n\nimport")
    config = (
        f'"""The settings of the module {name}."""\n\nfrom __future__ import annotations\n\n'
        f"from typing import Annotated\n\nimport msgspec\n\n\n{_filled('config', values)}"
    )
    folder = Path("services") / name
    files = {
        folder / "__init__.py": f'"""The module {name}."""\n',
        folder / "config.py": config,
        folder / "module.py": code,
        Path("tests/unit") / name / "test_module.py": _filled("module_test", values),
    }
    service = f"  {name}:\n    <<: *module\n    command: module {name} --state runs/latest/state\n"
    rows = [
        at_end_of(Path("services/registry.py"), "MODULES = (", f'    "{name}",'),
        in_list(
            Path("pyproject.toml"), '"cogmap.services.motor",', f'    "cogmap.services.{name}",'
        ),
        before(Path("compose.yaml"), "volumes:", service),
    ]
    _write(files, rows)


def _filled(template: str, values: Mapping[str, str]) -> str:
    text = (TEMPLATES / f"{template}.txt").read_text()
    return Template(text).substitute(values)


def _write(files: Mapping[Path, str], rows: list[Row]) -> None:
    """Write new files, and rows into tables.

    Raises UsageError, having written nothing, if a file is there already or a table has changed.
    """
    for path in files:
        if path.exists():
            raise UsageError(f"{path} is there already: choose another name, or remove it")

    changed: dict[Path, str] = {}
    for row in rows:
        changed[row.path] = row.added_to(changed.get(row.path) or row.path.read_text())

    for path, text in {**files, **changed}.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.rstrip("\n") + "\n")
        click.echo(f"{'changed' if path in changed else 'wrote'} {path}")


def _announce(sentence: str) -> None:
    click.echo(f"next: {sentence}")
