"""The wanderer by a msgpack library and Zenoh alone: what a module needs in any language.

Run it beside the others: `cogmap run --without motor`, and `python examples/wanderer_msgpack.py`.
"""

from __future__ import annotations

import array
import json
import queue
import threading
import time
from typing import Any

import msgpack
import zenoh

ENDPOINT = "tcp/127.0.0.1:7447"
AGENT = "agent"
INSTANCE = "motor"
STARTED_NS = time.time_ns()

AHEAD_RAD = 0.3
CLEARANCE_M = 4.0
CRUISE_RAD_S = 10.0


def floats(packed: dict[str, Any]) -> array.array[float]:
    """Return the values of an array of dtype <f4."""
    return array.array("f", packed["data"])


def command(scan: dict[str, Any], number: int) -> dict[str, Any]:
    """Return the message that answers a scan."""
    blocked = False
    for bearing_rad, range_m in zip(
        floats(scan["bearing_rad"]), floats(scan["range_m"]), strict=True
    ):
        if abs(bearing_rad) < AHEAD_RAD and 0 < range_m < CLEARANCE_M:
            blocked = True

    # The fields in the order of the schema: then the bytes are those of the same module of ours.
    return {
        "stamp_ns": scan["stamp_ns"],
        "seq": number,
        "source": INSTANCE,
        "left_wheel_rad_s": 0.0 if blocked else CRUISE_RAD_S,
        "right_wheel_rad_s": CRUISE_RAD_S,
        "halted_by": "",
        "slowed_by": "",
        "pose_age_ns": 0,
    }


def envelope(number: int, scan: dict[str, Any], received: list[Any]) -> list[Any]:
    """Make the envelope of the answer to a scan, by the envelope that was received with it: source,
    number, incarnation, sent, born, stages, causes.
    """
    born_ns = received[4]
    causes = [("sensory/scan", scan["source"], scan["seq"])]
    return [INSTANCE, number, STARTED_NS, time.time_ns(), born_ns, [], causes]


def configuration(endpoint: str) -> zenoh.Config:
    """Configure a client of the router at `endpoint`."""
    config = zenoh.Config()
    settings = {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


def run(endpoint: str, agent: str, stop: threading.Event) -> None:
    """Answer scans until `stop` is set."""
    scans: queue.Queue[zenoh.Sample] = queue.Queue()
    with zenoh.open(configuration(endpoint)) as session:
        commands = session.declare_publisher(f"cogmap/{agent}/motor/command")
        session.declare_subscriber(f"cogmap/{agent}/sensory/scan", scans.put)
        prefix = f"cogmap/{agent}"
        started = session.liveliness().declare_token(
            f"{prefix}/@incarnation/motor/{INSTANCE}/{STARTED_NS}"
        )
        ready = session.liveliness().declare_token(f"{prefix}/@ready/motor/{INSTANCE}")

        number = 0
        while not stop.is_set():
            try:
                sample = scans.get(timeout=0.1)
            except queue.Empty:
                continue

            if sample.attachment is None:
                continue
            scan = msgpack.unpackb(bytes(sample.payload))
            received = msgpack.unpackb(bytes(sample.attachment))
            commands.put(
                msgpack.packb(command(scan, number)),
                attachment=msgpack.packb(envelope(number, scan, received)),
            )
            number += 1
        ready.undeclare()  # type: ignore[no-untyped-call]
        started.undeclare()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    run(ENDPOINT, AGENT, threading.Event())
