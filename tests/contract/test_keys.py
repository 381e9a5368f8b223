"""A wrong key is said as such, by the process that has it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest

from cogmap.bus.access import site
from cogmap.bus.access.certificates import now_utc
from cogmap.bus.access.keys import Keys
from cogmap.bus.interface import Member
from cogmap.bus.session import free_endpoint, open_client, open_router
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.dashboard.live import Connection
from cogmap.errors import AccessError
from cogmap.schemas import topics
from cogmap.schemas.codelets import Offer
from tests.support.system.networks import routed

AGENT = "agent"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("site")
    site.make(made, now_utc())
    return made


def keys_in(folder: Path, name: str) -> Keys:
    return Keys(folder / name, name)


@pytest.fixture(scope="module")
def endpoint(folder: Path) -> Iterator[str]:
    address = free_endpoint()
    router = open_router(address, keys_in(folder, "router"))
    yield address
    router.close()  # type: ignore[no-untyped-call]


def refusal(endpoint: str, keys: Keys | None) -> str:
    with pytest.raises(AccessError) as caught:
        open_client(endpoint, 2.0, keys=keys)
    return str(caught.value)


def test_keys_of_another_site_are_said(endpoint: str, tmp_path: Path) -> None:
    site.make(tmp_path, now_utc())

    said = refusal(endpoint, keys_in(tmp_path, "motor"))

    assert "is of another site than the keys in" in said
    assert "--keys" in said


def test_a_certificate_of_another_authority_is_said(
    endpoint: str, folder: Path, tmp_path: Path
) -> None:
    site.make(tmp_path, now_utc())
    shutil.copy(folder / "motor" / "authority.pem", tmp_path / "motor" / "authority.pem")

    said = refusal(endpoint, keys_in(tmp_path, "motor"))

    assert "does not accept the certificate of motor" in said
    assert "not of this site's authority" in said


def test_an_expired_certificate_is_said(endpoint: str, folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "authority", tmp_path / "authority")
    site.make(tmp_path, now_utc() - timedelta(days=40), timedelta(days=39))

    said = refusal(endpoint, keys_in(tmp_path, "motor"))

    assert "the certificate of motor expired on" in said
    assert "cogmap keys make" in said


def test_an_expired_router_is_said(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "authority", tmp_path / "authority")
    site.make(tmp_path, now_utc() - timedelta(days=40), timedelta(days=39))
    address = free_endpoint()
    router = open_router(address, keys_in(tmp_path, "router"))

    said = refusal(address, keys_in(folder, "motor"))
    router.close()  # type: ignore[no-untyped-call]

    assert "has expired" in said


def test_a_module_cannot_pass_for_the_router(folder: Path) -> None:
    address = free_endpoint()
    router = open_router(address, keys_in(folder, "motor"))

    said = refusal(address, keys_in(folder, "epam"))
    router.close()  # type: ignore[no-untyped-call]

    assert "is not accepted" in said


def test_a_router_under_another_name_is_said(folder: Path) -> None:
    address = free_endpoint().replace("127.0.0.1", "127.0.0.2")
    router = open_router(address, keys_in(folder, "router"))

    said = refusal(address, keys_in(folder, "motor"))
    router.close()  # type: ignore[no-untyped-call]

    assert "does not name 127.0.0.2" in said
    assert "--host 127.0.0.2" in said


def test_a_router_without_keys_is_said(folder: Path) -> None:
    with routed() as address:
        said = refusal(address, keys_in(folder, "motor"))

    assert "does not speak TLS" in said


def test_a_client_without_keys_is_told_that_it_needs_them(endpoint: str) -> None:
    assert "asks for keys" in refusal(endpoint, None)
    assert "--keys" in refusal(endpoint.replace("tcp/", "tls/"), None)


def test_keys_that_do_not_belong_together_are_said(
    endpoint: str, folder: Path, tmp_path: Path
) -> None:
    mixed = tmp_path / "motor"
    shutil.copytree(folder / "motor", mixed)
    shutil.copy(folder / "epam" / "key.pem", mixed / "key.pem")

    assert "do not belong together" in refusal(endpoint, Keys(mixed, "motor"))


def test_what_is_not_allowed_is_refused_before_it_is_sent(endpoint: str, folder: Path) -> None:
    bus = ZenohBus(endpoint, AGENT, keys=keys_in(folder, "observer"))
    try:
        with pytest.raises(AccessError, match="observer may not publish workspace/offer"):
            bus.declare(topics.OFFER)
        with pytest.raises(AccessError, match="observer may not answer"):
            bus.serve(topics.SETTINGS_REQUEST, topics.SETTINGS, lambda _: None, lambda _: None)  # type: ignore[arg-type, return-value]
        with pytest.raises(AccessError, match="observer may not be motor of motor"):
            bus.announce(Member("motor", "motor"))
    finally:
        bus.close()


def test_a_dashboard_with_an_observers_keys_shows_and_refuses_clicks(
    endpoint: str, folder: Path
) -> None:
    bus = ZenohBus(endpoint, AGENT, keys=keys_in(folder, "observer"))
    try:
        connection = Connection(bus)
        with pytest.raises(AccessError, match="observer may not publish workspace/offer"):
            connection.publish(Offer(cycle=1, operations=[]))
    finally:
        bus.close()


def test_a_module_of_the_site_works_as_without_keys(endpoint: str, folder: Path) -> None:
    bus = ZenohBus(endpoint, AGENT, keys=keys_in(folder, "motor"))
    bus.declare(topics.MOTOR_COMMAND)
    bus.announce(Member("motor", "motor"))
    bus.close()
