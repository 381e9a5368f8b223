"""The environment variables that say where a process belongs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cogmap.bus.access.keys import Keys, found
from cogmap.bus.session import DEFAULT_AGENT, DEFAULT_ENDPOINT, check_name

CONNECT = "COGMAP_CONNECT"
AGENT = "COGMAP_AGENT"
KEYS = "COGMAP_KEYS"
CONFIG = "COGMAP_CONFIG"
ENDS_WITH = "COGMAP_ENDS_WITH"


def endpoint() -> str:
    """Return where the router listens: what $COGMAP_CONNECT says, else the default."""
    return os.environ.get(CONNECT) or DEFAULT_ENDPOINT


def agent() -> str:
    """Return the agent whose topics are meant: what $COGMAP_AGENT says, else the default. Raises
    UsageError for a name that cannot be part of a key.
    """
    name = os.environ.get(AGENT) or DEFAULT_AGENT
    check_name(f"${AGENT}", name)
    return name


def keys_folder() -> Path | None:
    """Return the folder of keys that $COGMAP_KEYS names; None if it names none."""
    folder = os.environ.get(KEYS)
    return Path(folder) if folder else None


def keys(*names: str) -> Keys | None:
    """Return the keys of the first of `names` that the folder of $COGMAP_KEYS has; None if that is
    not set. Raises AccessError if it has none of them.
    """
    folder = keys_folder()
    return None if folder is None else found(folder, names)


@contextmanager
def without_keys() -> Iterator[None]:
    """Let this process, and those that it starts, use no keys: on a bus of their own, on which
    nobody has a part who has a certificate.
    """
    folder = os.environ.pop(KEYS, None)
    try:
        yield
    finally:
        if folder is not None:
            os.environ[KEYS] = folder
