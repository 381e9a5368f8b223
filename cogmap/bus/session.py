"""The one place that opens a Zenoh session: clients with an explicit endpoint, and the router that
they connect to.
"""

from __future__ import annotations

import ipaddress
import json
import re
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

import zenoh

from cogmap.bus.access import handshake
from cogmap.bus.access.others import everybody
from cogmap.bus.access.rules import access_control
from cogmap.errors import AccessError, NoRouterError, PortInUseError, UsageError
from cogmap.heap import return_freed_memory_regularly, share_arenas
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic

if TYPE_CHECKING:
    from cogmap.bus.access.keys import Keys
    from cogmap.bus.interface import Member

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
DEFAULT_AGENT = "agent"
START_ROUTER = "start one with `cogmap run` or `cogmap router`, or name its endpoint with --connect"
EXPOSED = (
    "whoever reaches the router from another machine may read and command everything: "
    "make keys with `cogmap keys make DIR`, and name them with --keys"
)
# How long a client waits for a router, for one answer of it, and between two attempts; TCP's
# greatest port.
CONNECT_TIMEOUT_S = 5.0
ANSWER_S = 1.0
RETRY_S = 0.05
MAX_PORT = 65535
# How long a full link delays the others before it drops a message, which the publisher's cache
# restores later. Having dropped one, it drops the next at once until it has room: a subscriber that
# has stopped costs this long once.
WAIT_BEFORE_DROP_US = 100_000
# A stereo frame takes seven batches: with room for two only, a busy machine would drop it before it
# is sent.
QUEUE_BATCHES = 16
# Answers have the priority of their query: one of their own, whatever the asker chose. Where an
# answer fills its queue and a periodic query of a subscriber, which has the default, comes in
# between, Zenoh 1.10 sends neither and closes the link after 5 s.
ANSWER_PRIORITY = "background"
PROTOCOLS = (TCP, TLS) = ("tcp", "tls")
_QUEUES = ("data_high", "data", "data_low")
_NAME = re.compile(r"[\w.-]+")


class _Closer:
    """Closes the sessions that are open when the main thread has ended: Python waits for the
    threads of their callbacks, and a program that fails would never end.
    """

    def __init__(self) -> None:
        self._sessions: list[zenoh.Session] = []
        self._thread: threading.Thread | None = None
        self._lock = threading.Lock()

    def add(self, session: zenoh.Session) -> None:
        with self._lock:
            self._sessions = [each for each in self._sessions if not each.is_closed()]
            self._sessions.append(session)
            # A child that was forked does not have the thread of its parent.
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._close)
                self._thread.start()

    def _close(self) -> None:
        threading.main_thread().join()
        with self._lock:
            for session in self._sessions:
                session.close()  # type: ignore[no-untyped-call]


_closer = _Closer()


def check_name(option: str, name: str) -> None:
    """Raise UsageError if `name`, given by `option`, cannot be part of a key expression."""
    if not is_name(name):
        raise UsageError(
            f"{option} {name!r}: use letters, digits, '.', '-' and '_' only, such as robot-1"
        )


def is_name(name: str) -> bool:
    """Return whether `name` can be part of a key expression."""
    return _NAME.fullmatch(name) is not None


def past_key(agent: str, topic: Topic, source: str) -> str:
    """Return the key at which `source` answers for what it published on `topic`."""
    return f"{topic.key(agent)}/@past/{source}"


def ready_key(agent: str, member: Member) -> str:
    """Return the key of the liveliness token by which `member` announces that it is ready."""
    return f"cogmap/{agent}/@ready/{member.module}/{member.instance}"


def free_endpoint() -> str:
    """Return an endpoint on this machine where nothing listens."""
    return f"tcp/127.0.0.1:{free_port()}"


def free_port(wanted: int = 0) -> int:
    """Return a port of this machine where nothing listens: `wanted`, if it is one."""
    for port in (wanted, 0):
        with socket.socket() as probe, suppress(OSError):
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(("127.0.0.1", port))
            return int(probe.getsockname()[1])
    raise PortInUseError("no port of this machine is free: end something that listens")


def listens(port: int) -> bool:
    """Return whether something listens at `port` of this machine."""
    try:
        socket.create_connection(("127.0.0.1", port), ANSWER_S).close()
    except OSError:
        return False
    return True


def open_client(
    endpoint: str,
    timeout_s: float = CONNECT_TIMEOUT_S,
    is_asked_to_end: Callable[[], bool] | None = None,
    remedy: str = START_ROUTER,
    keys: Keys | None = None,
) -> zenoh.Session:
    """Return a session with the router at `endpoint`, by TLS where there are `keys`. Raises
    NoRouterError if none answers in time, and AccessError if it is not one for these keys.

    Until something listens there, Ctrl-C ends the wait at once. A process that handles signals
    itself gives `is_asked_to_end`: once that is true, the wait ends with KeyboardInterrupt.
    """
    _check_protocol(endpoint, keys)
    left_s = _await_listener(endpoint, timeout_s, is_asked_to_end or (lambda: False))
    settings: dict[str, object] = {
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": int(left_s * 1000),
        "connect/exit_on_failure": True,
        "connect/retry": {
            "period_init_ms": 50,
            "period_max_ms": 500,
            "period_increase_factor": 1.5,
        },
    }
    missing = NoRouterError(f"no router at {endpoint} within {timeout_s:g} s: {remedy}")
    if keys is not None:
        try:
            handshake.check(_address(endpoint), keys)
        except OSError:
            raise missing from None
        settings["connect/endpoints"] = [_secured(endpoint)]
        settings["transport/link/tls"] = keys.to_connect()

    try:
        session = _open("client", settings)
    except zenoh.ZError:
        if keys is None and handshake.speaks_tls(_address(endpoint)):
            raise AccessError(
                f"the router at {endpoint} asks for keys: name their folder with --keys"
            ) from None
        raise missing from None

    _closer.add(session)
    return session


def _await_listener(endpoint: str, timeout_s: float, is_asked_to_end: Callable[[], bool]) -> float:
    """Wait until something listens at `endpoint`, at most `timeout_s`. Returns the time left.

    Zenoh would wait with Python's signals unanswered.
    """
    address = _address(endpoint)
    until_s = time.monotonic() + timeout_s
    while (left_s := until_s - time.monotonic()) > RETRY_S:
        if is_asked_to_end():
            raise KeyboardInterrupt
        try:
            socket.create_connection(address, min(left_s, ANSWER_S)).close()
            break
        except OSError:
            time.sleep(RETRY_S)
    return max(RETRY_S, left_s)


def open_router(endpoint: str, keys: Keys | None = None) -> zenoh.Session:
    """Return a router that listens at `endpoint`; with `keys`, for those alone whom the rules
    allow. Raises PortInUseError if something else does listen.
    """
    _check_protocol(endpoint, keys)
    check_free(endpoint)
    settings: dict[str, object] = {
        "listen/endpoints": [endpoint],
        # Whoever asked it while a session declares would stop the router: see `discovery`.
        "adminspace/enabled": False,
    }
    if keys is not None:
        settings["listen/endpoints"] = [_secured(endpoint)]
        settings["transport/link/tls"] = keys.to_listen()
        settings["access_control"] = access_control(everybody(keys.folder).values())
    return _open("router", settings)


def from_here(endpoint: str) -> str:
    """Return where this machine reaches a router that listens at `endpoint`: one that listens at
    every address has a certificate for the loopback's, as no certificate names 0.0.0.0.
    """
    host, port = _address(endpoint)
    protocol, _, _ = endpoint.partition("/")
    own = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host)
    if own is not None:
        return f"{protocol}/{own}:{port}"
    return endpoint


def check_free(endpoint: str) -> None:
    """Raise PortInUseError if something listens at `endpoint` already, or nothing can."""
    host, port = _address(endpoint)
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise PortInUseError(
                f"cannot listen at {endpoint} ({error.strerror}): stop what listens there, "
                f"or choose another port with --connect tcp/{host}:PORT"
            ) from None


def _open(mode: str, own: dict[str, object]) -> zenoh.Session:
    """Open a session with its `own` settings and those that all have."""
    share_arenas()
    return_freed_memory_regularly()
    config = zenoh.Config()
    requests = [topic for topic in topics.ALL if topic.delivery is Delivery.ON_REQUEST]
    settings = own | {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        "transport/link/tx/queue/size": dict.fromkeys(_QUEUES, QUEUE_BATCHES),
        "transport/link/tx/queue/congestion_control/drop": {
            "wait_before_drop": WAIT_BEFORE_DROP_US,
            "max_wait_before_drop_fragments": WAIT_BEFORE_DROP_US,
        },
        "qos/network": [
            {
                "id": "answers",
                "key_exprs": [topic.key("*") for topic in requests],
                "messages": ["query"],
                "flows": ["ingress", "egress"],
                "overwrite": {"priority": ANSWER_PRIORITY},
            }
        ],
    }
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def is_exposed(endpoint: str) -> bool:
    """Return whether other machines reach what listens at `endpoint`."""
    host, _ = _address(endpoint)
    try:
        return not ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host != "localhost"


def _secured(endpoint: str) -> str:
    """Return `endpoint` as one of TLS: whoever has keys speaks nothing else."""
    _, _, address = endpoint.partition("/")
    return f"{TLS}/{address}"


def _check_protocol(endpoint: str, keys: Keys | None) -> None:
    """Raise AccessError if `endpoint` is one of TLS and there are no keys for it."""
    protocol, _, _ = endpoint.partition("/")
    if protocol == TLS and keys is None:
        raise AccessError(f"{endpoint} is for keys: name their folder with --keys or COGMAP_KEYS")


def _address(endpoint: str) -> tuple[str, int]:
    """Return host and port. Raises UsageError if `endpoint` is of neither TCP nor TLS."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    is_port = port.isdecimal() and int(port) <= MAX_PORT
    if protocol not in PROTOCOLS or not host or not is_port:
        raise UsageError(
            f"endpoint {endpoint!r}: write it as tcp/HOST:PORT, or tls/HOST:PORT with --keys, "
            f"with a port of at most {MAX_PORT}"
        )
    return host.strip("[]"), int(port)
