"""The folder of a site's keys, and what a session needs of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cogmap.errors import AccessError

AUTHORITY = "authority"
CERTIFICATE_NAME = "certificate.pem"
AUTHORITY_NAME = "authority.pem"
KEY_NAME = "key.pem"
ROUTER_CONFIG_NAME = "router.json5"


@dataclass(frozen=True)
class Keys:
    """What proves that a session is the subject `name`: three files in its own `folder`."""

    folder: Path
    name: str

    @property
    def authority(self) -> Path:
        """Return the certificate of the site's authority, by which the other end is judged."""
        return self.folder / AUTHORITY_NAME

    @property
    def certificate(self) -> Path:
        """Return the certificate, whose common name is `name`."""
        return self.folder / CERTIFICATE_NAME

    @property
    def key(self) -> Path:
        """Return the private key."""
        return self.folder / KEY_NAME

    def to_connect(self) -> dict[str, Any]:
        """Return Zenoh's settings of TLS for a client."""
        return {
            "root_ca_certificate": str(self.authority),
            "connect_certificate": str(self.certificate),
            "connect_private_key": str(self.key),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }

    def to_listen(self) -> dict[str, Any]:
        """Return Zenoh's settings of TLS for a router."""
        return {
            "root_ca_certificate": str(self.authority),
            "listen_certificate": str(self.certificate),
            "listen_private_key": str(self.key),
            "enable_mtls": True,
            "close_link_on_expiration": True,
        }


def found(folder: Path, names: Sequence[str]) -> Keys:
    """Return the keys of the first of `names` that `folder` has. Raises AccessError."""
    for name in names:
        keys = Keys(folder / name, name)
        if keys.certificate.exists():
            _check_readable(keys)
            return keys

    wanted = " or ".join(names)
    present = sorted(path.parent.name for path in folder.glob(f"*/{CERTIFICATE_NAME}"))
    others = [name for name in present if name != AUTHORITY]
    if not others:
        raise AccessError(f"{folder} has no keys: make them with `cogmap keys make {folder}`")
    raise AccessError(
        f"{folder} has no keys of {wanted}, but of {', '.join(others)}: "
        f"name a folder that has them with --keys"
    )


def _check_readable(keys: Keys) -> None:
    for path in (keys.authority, keys.certificate, keys.key):
        try:
            path.open("rb").close()
        except OSError as error:
            raise AccessError(
                f"cannot read {path} ({error.strerror}): run as the user whose keys these are"
            ) from None
