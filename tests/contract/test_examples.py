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
from cogmap.bus.session import free_port
from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.examples import GOLDEN
from cogmap.schemas.sensing import MotorCommand, RangeScan
from examples import in_process, wanderer, wanderer_msgpack
from tests.support import wandering
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


def test_msgpack_alone_computes_commands_of_the_same_bytes() -> None:
    module = _module()
    for seq, range_m in enumerate((20.0, 2.0)):
        scan = _scan(range_m, seq)
        plain = msgpack.unpackb(encode(scan))
        (expected,) = module.feed(scan)

        command = wanderer_msgpack.command(plain, seq)

        assert msgpack.packb(command) == encode(expected)


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
            assert envelope.causes == [("sensory/scan", "sensory", seq)]


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


def _answers_scans(command: list[str | Path], network: OverZenoh) -> None:
    """A program that is the module becomes ready and answers scans, until it is ended."""
    stage = Stage(network)
    process = subprocess.Popen(command)
    try:
        stage.check_answers()
    finally:
        process.terminate()
        process.wait(TIMEOUT_S)


def _built(binary: str, features: str = "") -> Path:
    """A program of the crate in Rust; the test is skipped if it has not been built."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", RUST / "target"))
    built = target / "debug" / binary
    if not built.exists():
        pytest.skip(f"`cargo build{features} --manifest-path examples/rust/Cargo.toml` builds it")
    return built


def _node() -> str:
    """Node; the test is skipped without it, or without what the package needs."""
    node = shutil.which("node")
    if node is None or not (JAVASCRIPT / "node_modules" / "@mcap").exists():
        pytest.skip("needs node, and `npm ci` in examples/javascript")
    return node


def test_the_module_in_rust_answers_scans(over_zenoh: OverZenoh) -> None:
    built = _built("wanderer", " --features bus")

    _answers_scans([built, over_zenoh.endpoint, over_zenoh.agent], over_zenoh)


def test_the_module_in_javascript_answers_scans(over_zenoh: OverZenoh) -> None:
    node = _node()
    bridge = shutil.which("zenoh-bridge-remote-api")
    if bridge is None:
        pytest.skip("`cargo install zenoh-bridge-remote-api` installs what it speaks through")

    # What `npm run bus` runs, without a shell and npm in between, which would outlive the test.
    package = json.loads((JAVASCRIPT / "package.json").read_text())
    _, *flags, script = package["scripts"]["bus"].split()

    port = free_port()
    place = ["--ws-port", f"127.0.0.1:{port}", "--no-multicast-scouting"]
    bridging = subprocess.Popen([bridge, "-m", "client", "-e", over_zenoh.endpoint, *place])
    try:
        program = [node, *flags, JAVASCRIPT / script]
        _answers_scans([*program, f"ws/127.0.0.1:{port}", over_zenoh.agent], over_zenoh)
    finally:
        bridging.terminate()
        bridging.wait(TIMEOUT_S)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a drive of the wanderer, recorded on this machine."""
    log = tmp_path_factory.mktemp("drive") / "wanderer.mcap"
    wandering.record(log, frames=8)
    return log


@pytest.fixture(params=["rust", "javascript"])
def replays(request: pytest.FixtureRequest) -> list[str | Path]:
    """The program that replays a log in a language, whose path follows."""
    if request.param == "rust":
        return [_built("replay")]
    return [_node(), JAVASCRIPT / "replay.mjs"]


def _replayed(command: list[str | Path], log: Path) -> subprocess.CompletedProcess[str]:
    arguments = [*command, log]
    return subprocess.run(arguments, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)


def test_the_committed_drive_of_the_wanderer_is_what_it_does_today() -> None:
    report = wandering.replay(wandering.LOG)

    assert report.same, f"{report.first}; `python -m tests.support.wandering` records it anew"
    (outcome,) = report.outcomes
    assert outcome.same == wandering.FRAMES


def test_other_languages_replay_a_drive_to_the_byte(replays: list[str | Path], drive: Path) -> None:
    run = _replayed(replays, drive)

    assert run.returncode == 0, run.stderr
    assert run.stdout == "motor: 8 commands the same to the byte, 0 not\n"


def test_other_languages_name_the_first_difference_of_a_replay(
    replays: list[str | Path], tmp_path: Path
) -> None:
    log = tmp_path / "faster.mcap"
    wandering.record(log, frames=3, settings=wanderer.Config(cruise_rad_s=11))

    run = _replayed(replays, log)

    assert run.returncode == 1
    counts, first = run.stdout.splitlines()
    assert counts == "motor: 0 commands the same to the byte, 3 not"
    assert first.startswith("first difference: motor/command number 0 of motor: ")
    assert first.endswith("_wheel_rad_s is 11 in the log, 10 in the replay")


def test_other_languages_say_what_a_log_lacks(replays: list[str | Path], tmp_path: Path) -> None:
    run = _replayed(replays, tmp_path / "absent.mcap")

    assert run.returncode == 2
    assert run.stderr.startswith(f"replay: {tmp_path / 'absent.mcap'}: ")


def test_the_tests_in_rust_pass() -> None:
    _built("replay")
    cargo = shutil.which("cargo")
    if cargo is None:
        pytest.skip("needs cargo")

    command = [cargo, "test", "--offline", "--locked", "--quiet"]

    run = subprocess.run(command, cwd=RUST, capture_output=True, text=True, check=False)

    assert run.returncode == 0, run.stdout + run.stderr


def test_the_tests_in_javascript_pass() -> None:
    command = [_node(), "--test"]

    run = subprocess.run(command, cwd=JAVASCRIPT, capture_output=True, text=True, check=False)

    assert run.returncode == 0, run.stdout + run.stderr


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
    node = _node()
    paths = sorted(GOLDEN.glob("*.msgpack"))
    command: list[str | Path] = [node, JAVASCRIPT / "golden.mjs", *paths]

    run = subprocess.run(command, capture_output=True, check=True, timeout=TIMEOUT_S)

    decoded = json.loads(run.stdout)
    assert len(decoded) == len(topics.ALL)
    for path in paths:
        plain = msgpack.unpackb(path.read_bytes())
        assert decoded[path.name] == _base64(plain)
