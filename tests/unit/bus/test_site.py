"""A site's folder of keys: made, renewed, shown."""

from __future__ import annotations

import json
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from cogmap.bus.access import certificates, site
from cogmap.bus.access.keys import found
from cogmap.bus.access.subjects import SUBJECTS
from cogmap.errors import AccessError

NOW = datetime(2026, 1, 1, tzinfo=UTC)
YEAR = timedelta(days=365)


def certificate(folder: Path, name: str) -> bytes:
    return (folder / name / "certificate.pem").read_bytes()


def test_everybody_in_the_table_gets_keys(tmp_path: Path) -> None:
    new = site.make(tmp_path, NOW)

    assert new == list(SUBJECTS)
    for name in SUBJECTS:
        read = certificates.read_certificate(found(tmp_path, [name]).certificate)
        (common_name,) = read.subject
        assert common_name.value == name


def test_only_their_owner_may_read_keys(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)

    keys = list(tmp_path.glob("*/key.pem"))
    assert len(keys) == len(SUBJECTS) + 1
    for path in keys:
        assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_keys_that_hold_are_left_alone(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)
    before = certificate(tmp_path, "motor")

    assert site.make(tmp_path, NOW + timedelta(days=1)) == []
    assert certificate(tmp_path, "motor") == before


def test_keys_that_expire_soon_are_renewed_by_the_same_authority(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)
    authority = certificate(tmp_path, "authority")

    new = site.make(tmp_path, NOW + timedelta(days=340))

    assert new == list(SUBJECTS)
    assert certificate(tmp_path, "authority") == authority
    for holder in site.holders(tmp_path):
        assert holder.problem(NOW + timedelta(days=340)) == ""


def test_a_lost_key_is_made_anew_alone(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)
    (tmp_path / "epam" / "key.pem").unlink()

    assert site.make(tmp_path, NOW) == ["epam"]


def test_without_the_authoritys_key_nothing_is_made(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)
    (tmp_path / "authority" / "certificate.pem").unlink()

    with pytest.raises(AccessError, match="not their authority's"):
        site.make(tmp_path, NOW, renews_all=True)


def test_what_expires_is_said_before_and_after(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)
    *_, last = site.holders(tmp_path)

    assert last.problem(NOW) == ""
    assert last.problem(NOW + YEAR - timedelta(days=10)) == "expires soon"
    assert last.problem(NOW + YEAR) == "expired"


def test_keys_of_another_authority_are_said(tmp_path: Path) -> None:
    site.make(tmp_path / "ours", NOW)
    site.make(tmp_path / "theirs", NOW)
    stolen = certificate(tmp_path / "theirs", "motor")
    (tmp_path / "ours" / "motor" / "certificate.pem").write_bytes(stolen)

    problems = {each.name: each.problem(NOW) for each in site.holders(tmp_path / "ours")}
    assert problems["motor"] == "of another authority"
    assert problems["epam"] == ""


def test_the_router_keeps_the_hosts_that_it_was_given(tmp_path: Path) -> None:
    site.make(tmp_path, NOW, hosts=["robot.local"])
    site.make(tmp_path, NOW, hosts=["10.0.0.7"])

    read = certificates.read_certificate(tmp_path / "router" / "certificate.pem")
    assert {"robot.local", "10.0.0.7", "127.0.0.1"} <= set(certificates.hosts_of(read))


def test_the_folder_of_one_is_enough_for_it(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)

    keys = found(tmp_path, ["motor"])
    used = {keys.authority, keys.certificate, keys.key}
    assert {path.parent for path in used} == {tmp_path / "motor"}


def test_missing_keys_are_said_with_those_that_there_are(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)
    for path in (tmp_path / "operator").iterdir():
        path.unlink()

    with pytest.raises(AccessError, match=r"no keys of operator, but of .*observer.*--keys"):
        found(tmp_path, ["operator"])
    with pytest.raises(AccessError, match="cogmap keys make"):
        found(tmp_path / "nowhere", ["operator"])


def test_the_rules_deny_what_they_do_not_name(tmp_path: Path) -> None:
    site.make(tmp_path, NOW)

    config = json.loads((tmp_path / "router" / "router.json5").read_text())
    access = config["access_control"]
    assert access["enabled"]
    assert access["default_permission"] == "deny"
    assert {rule["permission"] for rule in access["rules"]} == {"allow"}
    assert config["transport"]["link"]["tls"]["enable_mtls"]


def test_a_site_renewed_elsewhere_names_no_other_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site.make(tmp_path, NOW)
    monkeypatch.setattr("socket.gethostname", lambda: "container-2")

    assert site.make(tmp_path, NOW) == []
    site.make(tmp_path, NOW, renews_all=True)
    read = certificates.read_certificate(tmp_path / "router" / "certificate.pem")
    assert "container-2" not in certificates.hosts_of(read)
