"""The examples do what docs/modules.md states, and the pages show them as they are."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import sys
import threading
from os import environ
from pathlib import Path
from typing import Any

import msgpack
import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import decode, encode
from cogmap.bus.interface import Bus, Member
from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.examples import GOLDEN
from cogmap.schemas.sensing import MotorCommand, RangeScan
from examples import in_process, wanderer, wanderer_msgpack
from tests.support.includes import LANGUAGES, PAGES, ROOT, included, included_paths
from tests.support.system.networks import TIMEOUT_S, OverZenoh, Peer, publish

PAGE = ROOT / "docs" / "modules.md"
RUST = ROOT / "examples" / "rust"
JAVASCRIPT = ROOT / "examples" / "javascript"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_shows_the_files_that_it_includes(page: Path) -> None:
    text = page.read_text()

    assert included(text) == text, "`python -m tests.support.includes` writes it anew"


def test_every_example_is_shown_on_the_page() -> None:
    shown = included_paths(PAGE.read_text())
    paths = (ROOT / "examples").glob("*.*")
    written = {str(path.relative_to(ROOT)) for path in paths if path.suffix in LANGUAGES}

    assert written
    assert written <= set(shown)


def _scan(range_m: float, seq: int = 0) -> RangeScan:
    bearings = np.linspace(-0.5, 0.5, 5, dtype=np.float32)
    ranges = np.full(5, range_m, np.float32)
    return RangeScan(
        stamp_ns=7,
        seq=seq,
        source="sensory",
        frame=seq,
        bearing_rad=Array.of(bearings),
        range_m=Array.of(ranges),
    )


def _module() -> Module:
    return wanderer.build(wanderer.Config())


@pytest.mark.parametrize(("range_m", "left_rad_s"), [(20.0, 10.0), (0.0, 10.0), (2.0, 0.0)])
def test_the_module_turns_left_where_something_is_in_its_way(
    range_m: float, left_rad_s: float
) -> None:
    (command,) = _module().feed(_scan(range_m))

    assert isinstance(command, MotorCommand)
    assert command.stamp_ns == 7
    assert (command.left_wheel_rad_s, command.right_wheel_rad_s) == (left_rad_s, 10.0)


def test_the_module_rejects_a_scan_that_makes_no_sense() -> None:
    too_few = Array.of(np.ones(2, np.float32))
    bad = msgspec.structs.replace(_scan(1.0), range_m=too_few)

    with pytest.raises(MessageError, match=r"5,\) bearings, \(2"):
        _module().feed(bad)


def test_the_module_drives_the_robot_in_one_process() -> None:
    poses = in_process.drive(frames=4)

    assert poses[-1].travelled_m > poses[1].travelled_m > 0


def test_msgpack_alone_computes_the_same_commands() -> None:
    module = _module()
    for seq, range_m in enumerate((20.0, 2.0)):
        scan = _scan(range_m, seq)
        plain = msgpack.unpackb(encode(scan))
        (expected,) = module.feed(scan)

        command = wanderer_msgpack.command(plain, seq)

        assert decode(topics.MOTOR_COMMAND, msgpack.packb(command)) == expected


class Stage:
    """A peer that publishes scans and receives what answers them."""

    def __init__(self, network: OverZenoh) -> None:
        self._bus: Bus = network.join()
        self._commands = Peer(self._bus, topics.MOTOR_COMMAND)
        self._ready = threading.Event()
        self._bus.watch(self._on_change)
        self._bus.declare(topics.SCAN)

    def _on_change(self, member: Member, alive: bool) -> None:
        if alive and member == Member("motor", "motor"):
            self._ready.set()

    def check_answers(self) -> None:
        """The foreign module becomes ready, and answers each scan as ours does."""
        assert self._ready.wait(TIMEOUT_S)
        for seq, range_m in enumerate((20.0, 2.0)):
            publish(self._bus, _scan(range_m, seq))
            (arrival,) = self._commands.take(1)

            command = decode(topics.MOTOR_COMMAND, arrival.payload)
            assert isinstance(command, MotorCommand)
            assert command.left_wheel_rad_s == (0.0 if seq else 10.0)
            assert (command.source, command.seq) == ("motor", seq)

            envelope = arrival.envelope
            assert envelope is not None
            assert (envelope.source, envelope.seq) == ("motor", seq)


def test_a_module_of_msgpack_and_zenoh_alone_answers_scans(over_zenoh: OverZenoh) -> None:
    stage = Stage(over_zenoh)
    stop = threading.Event()
    arguments = (over_zenoh.endpoint, over_zenoh.agent, stop)
    thread = threading.Thread(target=wanderer_msgpack.run, args=arguments)
    thread.start()
    try:
        stage.check_answers()
    finally:
        stop.set()
        thread.join()


def test_the_module_as_a_program_takes_its_options_and_environment(over_zenoh: OverZenoh) -> None:
    stage = Stage(over_zenoh)
    command = [sys.executable, wanderer.__file__, "--set", "wanderer.cruise_rad_s=10"]
    places = {"COGMAP_CONNECT": over_zenoh.endpoint, "COGMAP_AGENT": over_zenoh.agent}
    process = subprocess.Popen([*command, "--set", "wanderer.clearance_m=4"], env=environ | places)
    try:
        stage.check_answers()
    finally:
        process.terminate()
        process.wait(TIMEOUT_S)


def test_a_setting_that_the_program_does_not_have_is_one_sentence() -> None:
    command = [sys.executable, wanderer.__file__, "--set", "wanderer.cruise=10"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)

    assert run.returncode == 2
    assert run.stderr.startswith("wanderer: unknown key 'cruise' in [wanderer]")


def test_the_module_in_rust_answers_scans(over_zenoh: OverZenoh) -> None:
    target = Path(os.environ.get("CARGO_TARGET_DIR", RUST / "target"))
    built = target / "debug" / "wanderer"
    if not built.exists():
        pytest.skip("`cargo build --manifest-path examples/rust/Cargo.toml` builds it")

    stage = Stage(over_zenoh)
    process = subprocess.Popen([built, over_zenoh.endpoint, over_zenoh.agent])
    try:
        stage.check_answers()
    finally:
        process.terminate()
        process.wait(TIMEOUT_S)


def _base64(value: Any) -> Any:
    """`value` as JSON has it: bytes as base64 text."""
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        return {name: _base64(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_base64(part) for part in value]
    return value


def test_javascript_decodes_every_golden_message() -> None:
    node = shutil.which("node")
    if node is None or not (JAVASCRIPT / "node_modules").exists():
        pytest.skip("needs node, and `npm ci` in examples/javascript")

    paths = sorted(GOLDEN.glob("*.msgpack"))
    command = [node, JAVASCRIPT / "golden.mjs", *paths]

    run = subprocess.run(command, capture_output=True, check=True, timeout=TIMEOUT_S)

    decoded = json.loads(run.stdout)
    assert len(decoded) == len(topics.ALL)
    for path in paths:
        plain = msgpack.unpackb(path.read_bytes())
        assert decoded[path.name] == _base64(plain)
