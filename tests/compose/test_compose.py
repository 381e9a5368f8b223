"""The system in its containers, built and run for real: needs Docker's engine and compose v2."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cli.launch.watch import Watch
from cogmap.bus.interface import Member
from cogmap.bus.zenoh_bus import ZenohBus

pytestmark = pytest.mark.compose

ROOT = Path(__file__).parents[2]
MODULES = (
    "sim",
    "sensory",
    "epam",
    "workspace",
    "codelets",
    "global_workspace",
    "action",
    "recorder",
)
TIMEOUT_S = 60.0


class Compose:
    """One project of `docker compose`, its router published at a port of its own."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self._environment = os.environ | {
            "COGMAP_PORT": str(self.port),
            "COMPOSE_PROJECT_NAME": f"cogmap-test-{os.getpid()}",
        }

    def __call__(self, *arguments: str) -> str:
        command = ["docker", "compose", *arguments]
        done = subprocess.run(
            command, cwd=ROOT, env=self._environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{' '.join(command)}:\n{(done.stdout + done.stderr)[-3000:]}"
        return done.stdout

    def containers(self, service: str) -> list[str]:
        return self("ps", "--quiet", service).split()


def docker(*arguments: str) -> str:
    return subprocess.run(
        ["docker", *arguments], capture_output=True, text=True, check=True
    ).stdout.strip()


def there_is_docker() -> bool:
    if shutil.which("docker") is None:
        return False
    asked = [["docker", "info"], ["docker", "compose", "version"]]
    return all(
        subprocess.run(command, capture_output=True, check=False).returncode == 0
        for command in asked
    )


@pytest.fixture(scope="module")
def compose() -> Iterator[Compose]:
    """The running system with two workers."""
    if not there_is_docker():
        missing = "no Docker engine with compose v2"
        pytest.fail(missing) if os.environ.get("CI") == "true" else pytest.skip(missing)
    project = Compose()
    try:
        project("build")
        project("up", "--detach", "--scale", "codelets=2")
        yield project
    finally:
        project("down", "--volumes", "--timeout", "5")


@pytest.fixture(scope="module")
def watch(compose: Compose) -> Iterator[Watch]:
    """An observer from outside the containers, through the published port."""
    watch = Watch(ZenohBus(f"tcp/127.0.0.1:{compose.port}", "agent"))
    yield watch
    watch.close()


def wait_until(watch: Watch, condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, f"it never happened; present: {sorted(watch.present)}"
        watch.pump(0.1)


def test_frames_lead_to_commands_that_move_the_robot(watch: Watch) -> None:
    wait_until(
        watch, lambda: watch.tally.observer.travelled_m > 3.0 and len(watch.tally.cycle_ms) > 5
    )


def test_each_worker_has_a_name_of_its_own(watch: Watch, compose: Compose) -> None:
    named = {
        Member("codelets", f"codelets-{container[:12]}")
        for container in compose.containers("codelets")
    }
    assert len(named) == 2
    wait_until(watch, lambda: named <= watch.present)


@pytest.mark.parametrize("service", [*MODULES, "router"])
def test_no_process_in_a_container_is_roots(compose: Compose, service: str) -> None:
    for container in compose.containers(service):
        users = docker("top", container, "-o", "pid,uid").split()[3::2]
        assert users and "0" not in users


def test_the_logs_say_which_module_says_what(compose: Compose) -> None:
    lines = compose("logs", "--no-color").splitlines()
    for service in ("sensory", "workspace", "action"):
        assert any(
            line.startswith(f"{service}-1 ") and f"{service} is ready" in line for line in lines
        )


def test_the_recorder_writes_a_log(compose: Compose) -> None:
    sizes = compose("exec", "-T", "recorder", "sh", "-c", "stat --format %s *.mcap").split()
    assert len(sizes) == 1
    assert int(sizes[0]) > 0


def test_the_log_has_what_the_workspace_says_from_its_first_message_on(compose: Compose) -> None:
    said = compose(
        "exec", "-T", "recorder", "sh", "-c", "cogmap log cat *.mcap presence -n 1 --json"
    )
    assert json.loads(said.splitlines()[0])["message"]["seq"] == 0


@pytest.mark.parametrize("service", ["epam", "workspace", "sim", "action"])
def test_a_container_that_is_killed_comes_back_and_the_drive_goes_on(
    watch: Watch, compose: Compose, service: str
) -> None:
    member = Member(service, service)
    wait_until(watch, lambda: member in watch.present)
    (container,) = compose.containers(service)
    pid = docker("inspect", "--format", "{{.State.Pid}}", container)
    kill = f"kill -9 {pid}"
    docker(
        "run", "--rm", "--pid", "host", "--user", "0", "--entrypoint", "sh", "cogmap", "-c", kill
    )
    wait_until(watch, lambda: member not in watch.present)
    wait_until(watch, lambda: member in watch.present)
    commands = len(watch.tally.cycle_ms)
    wait_until(watch, lambda: len(watch.tally.cycle_ms) > commands + 5)
    assert docker("inspect", "--format", "{{.RestartCount}}", container) == "1"
