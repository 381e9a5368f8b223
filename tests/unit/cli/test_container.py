"""What the image and compose.yaml hold: every package, and every module of the table."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import yaml

from cogmap.bus.access.keys import AUTHORITY
from cogmap.bus.access.subjects import SUBJECTS
from cogmap.services import registry
from cogmap.version import VERSION

ROOT = Path(__file__).parents[3]


def services() -> dict[str, dict[str, Any]]:
    written = (ROOT / "compose.yaml").read_text()
    compose: dict[str, dict[str, dict[str, Any]]] = yaml.safe_load(written)
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


def keys_of(service: str) -> list[str]:
    """Whose keys a service mounts, those that it may not change first."""
    mounted = [volume for volume in services()[service]["volumes"] if "/keys/" in volume]
    return [volume.partition(":")[0].removeprefix("keys-") for volume in mounted]


def test_every_service_has_a_health_check_but_those_that_end() -> None:
    unchecked = [name for name, each in services().items() if "healthcheck" not in each]

    assert unchecked == ["keys", "cogmap"]


def test_every_module_has_its_own_keys_and_no_others() -> None:
    for name in registry.MODULES:
        assert keys_of(name) == [name]


def test_only_the_service_that_makes_keys_may_write_them_or_has_the_authoritys() -> None:
    assert keys_of("keys") == [AUTHORITY, *SUBJECTS]
    for name, service in services().items():
        mounted = [volume for volume in service.get("volumes", []) if "/keys/" in volume]
        if name != "keys":
            assert all(volume.endswith(":ro") for volume in mounted)
            assert AUTHORITY not in keys_of(name)


def test_every_volume_of_keys_begins_as_a_folder_that_users_may_write() -> None:
    made = (ROOT / "Dockerfile").read_text().partition("for name in ")[2].partition(";")[0]

    assert made.replace("\\", "").split() == [AUTHORITY, *SUBJECTS]


def test_every_module_is_a_service() -> None:
    modules = set(registry.MODULES)

    assert modules <= set(services())


def test_every_module_keeps_its_state_where_a_restart_finds_it() -> None:
    configured = services()

    for name in registry.MODULES:
        assert "--state runs/latest/state" in str(configured[name])
