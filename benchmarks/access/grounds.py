"""A site to try to get into: its router, its keys, and those of strangers."""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

import zenoh

from cogmap.bus.access import certificates, site
from cogmap.bus.access.keys import Keys
from cogmap.bus.access.rules import access_control
from cogmap.bus.access.subjects import ROUTER, SUBJECTS, Subject
from cogmap.bus.session import free_endpoint
from cogmap.errors import CogmapError
from cogmap.schemas import topics

AGENT = "agent"
WITNESS = "witness"
OPEN_S = 2.0
START_S = 30.0
_ALL = frozenset(topics.ALL)
_DAY = timedelta(days=1)


@dataclass(frozen=True)
class Grounds:
    """A router with keys at `endpoint`. `witness` has a certificate that allows everything, by
    which is seen what others achieve. In `folder` are the keys of the site, and of strangers.
    """

    endpoint: str
    folder: Path
    witness: zenoh.Session

    def keys(self, name: str) -> Keys:
        """Return the keys of a subject of the site."""
        return Keys(self.folder / "site" / name, name)

    def strangers_keys(self, name: str) -> Keys:
        """Return keys of that name by another authority, which trust this site's router."""
        return Keys(self.folder / "strangers" / name, name)


@contextmanager
def grounds(folder: Path, zenohd: str = "") -> Iterator[Grounds]:
    """Make a site in `folder` and run its router: a session of this process, or the program
    `zenohd`. Raises CogmapError if that does not start.
    """
    _make(folder)
    endpoint = free_endpoint().replace("tcp/", "tls/")
    config = site.router_config(folder / "site")
    everybody = (*SUBJECTS.values(), _witness())
    config["access_control"] = access_control(everybody)
    config["listen"] = {"endpoints": [endpoint]}
    path = folder / "router.json5"
    path.write_text(json.dumps(config))

    with ExitStack() as closing:
        if zenohd:
            _start(zenohd, path, closing)
        else:
            router = zenoh.open(zenoh.Config.from_file(str(path)))
            closing.callback(router.close)
        witness = _opened_in_time(lambda: session(endpoint, Keys(folder / "site/witness", WITNESS)))
        closing.callback(witness.close)
        yield Grounds(endpoint, folder, witness)


def session(endpoint: str, keys: Keys | None, trusts: Path | None = None) -> zenoh.Session | None:
    """Open a session past every check of ours, as who attacks would; None if it is not let in.
    Without `keys` it shows no certificate; it may still trust an authority.
    """
    settings: dict[str, Any] = {
        "mode": "client",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": int(1000 * OPEN_S),
        "connect/exit_on_failure": True,
    }
    if keys is not None:
        settings["transport/link/tls"] = keys.to_connect()
    elif trusts is not None:
        settings["transport/link/tls"] = {"root_ca_certificate": str(trusts)}

    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    with suppress(zenoh.ZError):
        return zenoh.open(config)
    return None


def _make(folder: Path) -> None:
    """Make the keys of the site and its witness, and those of strangers."""
    now = certificates.now_utc()
    place = folder / "site"
    site.make(place, now)
    strangers = folder / "strangers"
    site.make(strangers, now)
    for name in SUBJECTS:
        shutil.copy(place / name / "authority.pem", strangers / name / "authority.pem")

    authority = certificates.Issued(
        certificates.read_certificate(place / "authority" / "certificate.pem"),
        certificates.read_key(place / "authority" / "key.pem"),
    )
    issued = certificates.issue(authority, WITNESS, now, _DAY)
    own = Keys(place / WITNESS, WITNESS)
    own.folder.mkdir(exist_ok=True)
    own.certificate.write_bytes(certificates.pem_of_certificate(issued))
    own.key.write_bytes(certificates.pem_of_key(issued))
    shutil.copy(place / ROUTER / "authority.pem", own.authority)


def _witness() -> Subject:
    members = {member.partition("/")[0] for each in SUBJECTS.values() for member in each.members}
    return Subject(WITNESS, _ALL, _ALL, _ALL, _ALL, tuple(sorted(members)), discovers=True)


def _start(zenohd: str, config: Path, closing: ExitStack) -> None:
    """Start zenohd, and end it with `closing`."""
    try:
        log = closing.enter_context((config.parent / "zenohd.log").open("wb"))
        process = subprocess.Popen([zenohd, "--config", str(config)], stdout=log, stderr=log)
    except OSError as error:
        raise CogmapError(f"cannot start {zenohd} ({error.strerror})") from None

    def end() -> None:
        process.kill()
        process.wait()

    closing.callback(end)


def _opened_in_time(attempt: Callable[[], zenoh.Session | None]) -> zenoh.Session:
    """Try until the router lets the witness in. Raises CogmapError if it does not in START_S."""
    until_s = time.monotonic() + START_S
    while time.monotonic() < until_s:
        opened = attempt()
        if opened is not None:
            return opened
    raise CogmapError(f"the router let nobody in within {START_S:g} s: see its log")
