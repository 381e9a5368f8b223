"""What the image and compose.yaml hold: every package, and every module of the table."""

from __future__ import annotations

import tomllib
from pathlib import Path

import yaml

from cogmap.services import registry
from cogmap.version import VERSION

ROOT = Path(__file__).parents[3]


def services() -> dict[str, dict[str, str]]:
    written = (ROOT / "compose.yaml").read_text()
    compose: dict[str, dict[str, dict[str, str]]] = yaml.safe_load(written)
    return compose["services"]


def test_the_image_gets_every_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    found = project["tool"]["setuptools"]["packages"]["find"]["include"]
    packages = {pattern.rstrip("*") for pattern in found}

    ignored = (ROOT / ".dockerignore").read_text().splitlines()
    copied = {line.removeprefix("!") for line in ignored}
    assert packages
    assert packages <= copied


def test_the_image_says_its_version() -> None:
    label = f'org.opencontainers.image.version="{VERSION}"'

    assert label in (ROOT / "Dockerfile").read_text()


def test_every_service_has_a_health_check_but_the_one_of_verbs() -> None:
    unchecked = [name for name, each in services().items() if "healthcheck" not in each]

    assert unchecked == ["cogmap"]


def test_every_module_is_a_service() -> None:
    modules = set(registry.MODULES)

    assert modules <= set(services())


def test_every_module_keeps_its_state_where_a_restart_finds_it() -> None:
    configured = services()

    for name in registry.MODULES:
        assert "--state runs/latest/state" in str(configured[name])
