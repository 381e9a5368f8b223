"""The environment variables that say where a process belongs."""

from __future__ import annotations

import os

from cogmap.bus.session import DEFAULT_AGENT, DEFAULT_ENDPOINT, check_name

CONNECT = "COGMAP_CONNECT"
AGENT = "COGMAP_AGENT"
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
