"""`cogmap keys`, and what doctor finds of keys."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from cogmap.bus.access import site
from cogmap.bus.access.certificates import now_utc
from cogmap.bus.access.subjects import SUBJECTS
from cogmap.bus.session import from_here, is_exposed
from cogmap.cli.doctor.keys import examine
from cogmap.cli.main import cogmap
from cogmap.errors import AccessError
from cogmap.runtime import environment


def keys(*words: str | Path) -> Result:
    return CliRunner().invoke(cogmap, ["keys", *map(str, words)])


def test_keys_are_made_once_and_renewed_when_asked(tmp_path: Path) -> None:
    assert "new keys of sim, " in keys("make", tmp_path).output
    assert "all keys hold" in keys("make", tmp_path).output
    assert "new keys of sim, " in keys("make", tmp_path, "--renew").output


def test_keys_that_hold_are_shown_with_their_ends(tmp_path: Path) -> None:
    keys("make", tmp_path)

    shown = keys("show", tmp_path)

    assert shown.exit_code == 0
    assert len(shown.output.splitlines()) == len(SUBJECTS) + 1
    assert shown.output.startswith("authority")


def test_keys_that_expire_soon_end_with_1_and_the_remedy(tmp_path: Path) -> None:
    keys("make", tmp_path, "--days", "10")

    shown = keys("show", tmp_path)

    assert shown.exit_code == 1
    assert "motor (expires soon)" in shown.output
    assert f"renew with `cogmap keys make {tmp_path}`" in shown.output


def test_a_folder_without_keys_is_said(tmp_path: Path) -> None:
    result = keys("show", tmp_path)

    assert isinstance(result.exception, AccessError)


def test_doctor_finds_what_expires(tmp_path: Path) -> None:
    site.make(tmp_path, now_utc(), timedelta(days=10))

    found = [str(finding) for finding in examine(tmp_path, now_utc())]

    assert len(found) == len(SUBJECTS)
    assert all("expires soon: renew it with `cogmap keys make" in each for each in found)


def test_doctor_finds_nothing_wrong_with_keys_that_hold(tmp_path: Path) -> None:
    site.make(tmp_path, now_utc())

    assert list(examine(tmp_path, now_utc())) == []


def test_a_command_that_reads_uses_an_observers_keys_if_it_can(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site.make(tmp_path, now_utc())
    monkeypatch.setenv(environment.KEYS, str(tmp_path))

    reading = environment.keys("observer", "operator")
    assert reading is not None
    assert reading.name == "observer"

    for path in (tmp_path / "observer").iterdir():
        path.unlink()
    reading = environment.keys("observer", "operator")
    assert reading is not None
    assert reading.name == "operator"


def test_without_the_variable_there_are_no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(environment.KEYS, raising=False)

    assert environment.keys("motor") is None


def test_a_bus_of_its_own_has_no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(environment.KEYS, "/somewhere")

    with environment.without_keys():
        assert environment.keys_folder() is None
    assert environment.keys_folder() == Path("/somewhere")


@pytest.mark.parametrize(
    ("endpoint", "exposed"),
    [
        ("tcp/127.0.0.1:7447", False),
        ("tcp/localhost:7447", False),
        ("tcp/[::1]:7447", False),
        ("tcp/0.0.0.0:7447", True),
        ("tcp/robot.local:7447", True),
    ],
)
def test_a_router_that_others_reach_is_known(endpoint: str, exposed: bool) -> None:
    assert is_exposed(endpoint) is exposed


@pytest.mark.parametrize(
    ("endpoint", "reached"),
    [
        ("tcp/0.0.0.0:7447", "tcp/127.0.0.1:7447"),
        ("tls/[::]:7447", "tls/[::1]:7447"),
        ("tls/robot.local:7447", "tls/robot.local:7447"),
    ],
)
def test_a_router_at_every_address_is_reached_where_its_certificate_holds(
    endpoint: str, reached: str
) -> None:
    assert from_here(endpoint) == reached
