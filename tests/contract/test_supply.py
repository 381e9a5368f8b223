"""What the container is made of: packages by hashes, of the versions that are pinned."""

from __future__ import annotations

import re
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support.audit import UNREACHABLE_EXIT, VULNERABLE_EXIT, verdict
from tests.support.hashes import HEAD, PATH, PINNED, REQUIREMENTS
from tests.support.includes import ROOT

HASHED = PATH.read_text().removeprefix(HEAD)
REMEDY = "run `make hashes`"


def _hashed() -> dict[str, tuple[Requirement, list[str]]]:
    """Each package of the file with its hashes, by its canonical name."""
    found: dict[str, tuple[Requirement, list[str]]] = {}
    for entry in HASHED.replace("\\\n", " ").splitlines():
        if not entry or entry.startswith("#"):
            continue
        pin, *hashes = re.split(r"\s+--hash=", entry.strip())
        requirement = Requirement(pin)
        found[canonicalize_name(requirement.name)] = (requirement, hashes)
    return found


def test_every_pin_of_the_container_has_its_hashes() -> None:
    hashed = _hashed()
    for name in PINNED:
        for line in (REQUIREMENTS / name).read_text().splitlines():
            pin = Requirement(line)
            assert canonicalize_name(pin.name) in hashed, f"{pin.name}: {REMEDY}"
            requirement, _ = hashed[canonicalize_name(pin.name)]
            assert requirement.specifier == pin.specifier, f"{pin.name}: {REMEDY}"
            assert requirement.marker == pin.marker, f"{pin.name}: {REMEDY}"


def test_every_package_has_one_version_and_sha_256_hashes_alone() -> None:
    for name, (requirement, hashes) in _hashed().items():
        (version,) = requirement.specifier
        assert version.operator == "==", name
        assert hashes, name
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}", each) for each in hashes), name


def test_the_hashes_name_no_address_and_say_how_they_are_made() -> None:
    assert PATH.read_text().startswith(HEAD)
    assert "://" not in HASHED
    assert "--index-url" not in HASHED


def test_the_image_is_built_of_packages_with_hashes_on_a_base_that_can_be_pinned() -> None:
    dockerfile = (ROOT / "Dockerfile").read_text()

    assert "--require-hashes" in dockerfile
    assert "requirements/run.hashes.txt" in dockerfile
    assert "ARG BASE=" in dockerfile
    assert "FROM ${BASE}" in dockerfile


def _package(**facts: Any) -> dict[str, Any]:
    return {"name": "lz4", "version": "4.4.5", **facts}


def test_an_audit_that_could_look_up_nothing_is_no_clean_one() -> None:
    code, said = verdict({"dependencies": [_package(skip_reason="not found"), _package(vulns=[])]})

    assert code == UNREACHABLE_EXIT
    assert "1 of 2 packages" in said


def test_an_audit_names_each_vulnerability_and_what_fixes_it() -> None:
    found = {"id": "CVE-1", "fix_versions": ["4.4.6"]}

    code, said = verdict({"dependencies": [_package(vulns=[found]), _package(vulns=[])]})

    assert code == VULNERABLE_EXIT
    assert said == "lz4 4.4.5: CVE-1, fixed in 4.4.6"
    assert verdict({"dependencies": [_package(vulns=[])]})[0] == 0
