"""The metrics of ros2: how long the bridge holds up what a robot senses, and what it is told."""

from __future__ import annotations

import multiprocessing
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from benchmarks.benchmark import Setting
from benchmarks.optional import zenoh_ros2_sdk
from benchmarks.report import Metrics
from benchmarks.ros2 import robot
from benchmarks.ros2.robot import Driven
from benchmarks.threshold import at_most
from cogmap.bus.session import free_endpoint, open_router
from cogmap.cli.launch.command_line import cogmap_command, environment
from cogmap.errors import CogmapError
from cogmap.robot import WHEEL_RADIUS_M
from cogmap.runtime.client import Client
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import MotorCommand, StereoFrame

THRESHOLDS = {"latency_ms_p99": at_most(20.0), "lost": at_most(0.0)}
VIEWS = 600
UNCOUNTED = 20
"""The first views: processes import what they need as they do it for the first time."""

MAX_SPEED_M_S = 40.0
"""Far above the speed of the last command."""

MAX_RATE_HZ = 100
"""A robot that was late catches up: all its views count."""

START_S = 60.0
REST_S = 1.0
END_S = 20.0


class Mind:
    """Notes when views arrive, as which frame of the bridge, and answers each by a command with the
    view's number.
    """

    def __init__(self) -> None:
        self.views_ns: dict[int, int] = {}
        self.commands_ns: dict[int, int] = {}
        self.frames: dict[int, int] = {}

    def on_frame(self, frame: StereoFrame) -> MotorCommand:
        """Answer a view."""
        arrived_ns = time.monotonic_ns()
        number = robot.number_of(np.asarray(frame.left.numpy(), np.uint8))
        self.frames[number] = frame.frame
        self.views_ns[number] = arrived_ns
        wheel_rad_s = number * robot.COUNTED_M_S / WHEEL_RADIUS_M
        command = MotorCommand(
            stamp_ns=frame.stamp_ns, left_wheel_rad_s=wheel_rad_s, right_wheel_rad_s=wheel_rad_s
        )
        self.commands_ns[number] = time.monotonic_ns()
        return command

    def module(self) -> Module:
        """Return the module that takes the place of `motor`."""
        return Module("motor").on(topics.STEREO, self.on_frame, [topics.MOTOR_COMMAND])


def measure(setting: Setting) -> Metrics:
    """Measure how long messages take through `cogmap ros2`, and how many it loses.

    A robot in a process of its own publishes a pair of grey images of 320 x 240 ten times a second,
    with calibration, and odometry fifty times, as rmw_zenoh does: by libraries of others. Counted
    is from its put of a pair until a module has decoded the view that the bridge publishes on our
    bus, and from a module's motor command until the robot has decoded the twist; each of the two
    with its router in between on either side. `latency_ms_p99` is the longer of both 99th
    percentiles. `lost` are pairs that the bridge did not publish, and commands that did not arrive:
    these topics are reliable. A view that a newer one overtook on our bus is `superseded`, as is
    meant there. Takes a minute and a half.
    """
    zenoh_ros2_sdk()
    endpoint = free_endpoint()
    router = open_router(endpoint)
    mind = Mind()
    try:
        with _robot(endpoint) as driven, _bridge(endpoint):
            setting.announce(f"driving until {VIEWS} views have come")
            with Client(mind.module(), endpoint):
                _await(mind, UNCOUNTED + VIEWS)
                time.sleep(REST_S)
    finally:
        router.close()  # type: ignore[no-untyped-call]

    return metrics_of(mind, driven[0])


def metrics_of(mind: Mind, driven: Driven) -> Metrics:
    """Return the metrics of VIEWS views after the UNCOUNTED first ones, and of the commands that
    answer them.
    """
    first = min(mind.views_ns) + UNCOUNTED
    last = max(number for number in mind.frames if number < first + VIEWS)
    first = min(number for number in mind.frames if number >= first)
    passed = mind.frames[last] - mind.frames[first]
    counted = range(first, last + 1)
    views_ms = _waits_ms(driven.views_ns, mind.views_ns, counted)
    commands_ms = _waits_ms(mind.commands_ns, driven.commands_ns, counted)
    view_p99, command_p99 = (float(np.percentile(each, 99)) for each in (views_ms, commands_ms))
    return {
        "latency_ms_p99": max(view_p99, command_p99),
        "lost": float(last - first - passed + len(views_ms) - len(commands_ms)),
        "views": float(len(views_ms)),
        "superseded": float(passed + 1 - len(views_ms)),
        "view_ms_p50": float(np.median(views_ms)),
        "view_ms_p99": view_p99,
        "command_ms_p50": float(np.median(commands_ms)),
        "command_ms_p99": command_p99,
    }


def _waits_ms(sent_ns: dict[int, int], received_ns: dict[int, int], counted: range) -> list[float]:
    """Return how long each of the counted took that arrived."""
    both = [number for number in counted if number in sent_ns and number in received_ns]
    return [(received_ns[number] - sent_ns[number]) / 1e6 for number in both]


def _await(mind: Mind, views: int) -> None:
    """Wait until so many views have been passed. Raises CogmapError if they take too long."""
    until_s = time.monotonic() + START_S
    while not mind.views_ns:
        _check(until_s, "no view came")
    until_s = time.monotonic() + START_S + views / robot.RATE_HZ
    last = min(mind.views_ns) + views
    while max(mind.views_ns) < last:
        _check(until_s, f"only {len(mind.views_ns)} views came")


def _check(until_s: float, what: str) -> None:
    time.sleep(0.1)
    if time.monotonic() > until_s:
        raise CogmapError(f"{what} in time: see what `cogmap ros2` prints")


@contextmanager
def _bridge(endpoint: str) -> Iterator[None]:
    """Run the bridge."""
    options = ("--max-speed", str(MAX_SPEED_M_S), "--rate", str(MAX_RATE_HZ))
    command = cogmap_command("ros2", "--connect", endpoint, *options)
    process = subprocess.Popen(command, env=environment())
    try:
        yield
    finally:
        process.terminate()
        process.wait(END_S)


@contextmanager
def _robot(endpoint: str) -> Iterator[list[Driven]]:
    """Run the robot; what it noted is in the list at the end."""
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=robot.drive, args=(endpoint, theirs), daemon=True)
    process.start()
    driven: list[Driven] = []
    try:
        yield driven
    finally:
        ours.send(None)
        if ours.poll(END_S):
            driven.append(ours.recv())
        process.join(END_S)
