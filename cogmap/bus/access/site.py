"""A site: an authority, and a folder of keys for each subject, in one folder.

    DIR/authority/key.pem          the authority's: with it anybody can make keys; keep it apart
    DIR/motor/certificate.pem      who the holder is
    DIR/motor/key.pem              the proof of it
    DIR/motor/authority.pem        the authority, by which the other end is judged
    DIR/router/router.json5        TLS and rules, as a configuration of zenohd

Whoever runs as a subject needs the folder of that subject alone.
"""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from cogmap.bus.access import certificates
from cogmap.bus.access.certificates import Issued
from cogmap.bus.access.keys import (
    AUTHORITY,
    AUTHORITY_NAME,
    CERTIFICATE_NAME,
    KEY_NAME,
    ROUTER_CONFIG_NAME,
    Keys,
)
from cogmap.bus.access.others import MODULES_NAME, everybody, read
from cogmap.bus.access.rules import access_control
from cogmap.bus.access.subjects import ROUTER
from cogmap.errors import AccessError, StorageError

DAYS = 365
SOON = timedelta(days=30)
"""A certificate that expires sooner is renewed, and shown as a problem."""
PRIVATE = 0o600
PUBLIC = 0o644


class Holder(NamedTuple):
    """A certificate of a site: whose it is, and until when it holds. `is_ours` is whether the
    site's authority has issued it.
    """

    name: str
    until: datetime
    is_ours: bool

    def problem(self, now: datetime) -> str:
        """Say what is wrong with it at `now`; empty if nothing is."""
        if not self.is_ours:
            return "of another authority"
        if self.until <= now:
            return "expired"
        return "expires soon" if self.until - now < SOON else ""


def make(
    folder: Path,
    now: datetime,
    lasts: timedelta = timedelta(days=DAYS),
    *,
    hosts: Sequence[str] = (),
    renews_all: bool = False,
    modules: Path | None = None,
) -> list[str]:
    """Make what `folder` lacks of the keys of a site, renew what expires soon, or `renews_all` of
    it, and write the router's configuration. Returns whose certificates are new.

    The authority stays. The router's certificate names this machine, `hosts`, and those that it
    named before. The file `modules` has rows for modules of others, which the folder keeps. Raises
    AccessError if they are no rows, or the authority's key is not there, and StorageError if a file
    cannot be written.
    """
    try:
        authority = _authority(folder, now)
        if modules is not None:
            read(modules)
            _write(folder / ROUTER / MODULES_NAME, modules.read_bytes(), PUBLIC)

        new = []
        for name in everybody(folder / ROUTER):
            named = _hosts(folder, hosts) if name == ROUTER else []
            if renews_all or not _holds(folder, name, authority, now, named):
                issued = certificates.issue(authority, name, now, lasts, named)
                _write_pair(folder / name, issued)
                _write(folder / name / AUTHORITY_NAME, _pem(authority), PUBLIC)
                new.append(name)

        config = json.dumps(router_config(folder), indent=2)
        _write(folder / ROUTER / ROUTER_CONFIG_NAME, config.encode(), PUBLIC)
    except OSError as error:
        raise StorageError(
            f"cannot write {error.filename or folder} ({error.strerror}): name another folder"
        ) from error
    return new


def router_config(folder: Path) -> dict[str, Any]:
    """Return the configuration of a router of this site, for zenohd."""
    keys = Keys(folder.resolve() / ROUTER, ROUTER)
    return {
        "mode": "router",
        "listen": {"endpoints": ["tls/0.0.0.0:7447"]},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "adminspace": {"enabled": False},
        "transport": {"link": {"protocols": ["tls"], "tls": keys.to_listen()}},
        "access_control": access_control(everybody(folder / ROUTER).values()),
    }


def holders(folder: Path) -> list[Holder]:
    """List the certificates in a site's folder, the authority's first. Raises AccessError."""
    paths = sorted(folder.glob(f"*/{CERTIFICATE_NAME}"))
    if not paths:
        raise AccessError(f"{folder} has no keys: make them with `cogmap keys make {folder}`")

    paths.sort(key=lambda path: path.parent.name != AUTHORITY)
    found = []
    for path in paths:
        certificate = certificates.read_certificate(path)
        is_ours = True
        if path.parent.name != AUTHORITY:
            authority = certificates.read_certificate(path.parent / AUTHORITY_NAME)
            is_ours = certificates.is_issued_by(authority, certificate)
        found.append(Holder(path.parent.name, certificate.not_valid_after_utc, is_ours))
    return found


def _authority(folder: Path, now: datetime) -> Issued:
    """Return the site's authority, a new one if the folder has no keys yet. Raises AccessError."""
    place = folder / AUTHORITY
    if (place / CERTIFICATE_NAME).exists():
        authority = Issued(
            certificates.read_certificate(place / CERTIFICATE_NAME),
            certificates.read_key(place / KEY_NAME),
        )
        if authority.certificate.not_valid_after_utc <= now:
            raise AccessError(
                f"the authority of {folder} has expired: make new keys in another folder"
            )
        return authority
    if any(folder.glob(f"*/{CERTIFICATE_NAME}")):
        raise AccessError(
            f"{folder} has keys, but not their authority's: make new ones where {AUTHORITY}/ is"
        )

    authority = certificates.make_authority(now)
    _write_pair(place, authority)
    return authority


def _holds(folder: Path, name: str, authority: Issued, now: datetime, hosts: Sequence[str]) -> bool:
    """Return whether the certificate of `name` need not be renewed."""
    keys = Keys(folder / name, name)
    if not (keys.certificate.exists() and keys.key.exists() and keys.authority.exists()):
        return False

    certificate = certificates.read_certificate(keys.certificate)
    is_ours = certificates.is_issued_by(authority.certificate, certificate)
    names_hosts = set(hosts) <= set(certificates.hosts_of(certificate))
    return is_ours and names_hosts and certificate.not_valid_after_utc - now >= SOON


def _hosts(folder: Path, given: Sequence[str]) -> list[str]:
    """Return all hosts that the router's certificate is to name: also this machine's name where it
    has none yet, but not that of a container in which it is renewed.
    """
    named = [socket.gethostname()]
    with suppress(AccessError):
        certificate = certificates.read_certificate(folder / ROUTER / CERTIFICATE_NAME)
        named = certificates.hosts_of(certificate)
    return list(dict.fromkeys(["localhost", "127.0.0.1", "::1", *named, *given]))


def _pem(authority: Issued) -> bytes:
    return certificates.pem_of_certificate(authority)


def _write_pair(folder: Path, issued: Issued) -> None:
    _write(folder / KEY_NAME, certificates.pem_of_key(issued), PRIVATE)
    _write(folder / CERTIFICATE_NAME, certificates.pem_of_certificate(issued), PUBLIC)


def _write(path: Path, content: bytes, mode: int) -> None:
    """Write a file that has its mode from the first byte on, in the place of an older one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".new")
    temporary.unlink(missing_ok=True)
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)
    temporary.replace(path)
