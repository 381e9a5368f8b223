"""The system in its containers, built and run for real: needs Docker's engine and compose v2."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from aiohttp import ClientSession

from cogmap.bus.access.keys import Keys
from cogmap.bus.interface import Member
from cogmap.bus.session import free_endpoint, free_port
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.launch.drive_metrics import Recording
from cogmap.cli.launch.watch import Watch
from cogmap.errors import AccessError
from cogmap.services import registry

pytestmark = pytest.mark.compose

ROOT = Path(__file__).parents[2]
SERVICES = (*registry.MODULES, "drive", "router", "dashboard")
WORKERS = ("--scale", "codelets=2")
RUN = "/var/lib/cogmap/runs/latest"
TIMEOUT_S = 90.0
MAX_MB = {"cogmap": 700, "cogmap-sim": 900}
OWNER = os.getuid() or 4711
"""The user whose folder takes the results: none of the image's, and not root."""
MAX_NEWS = 300
"""What a browser is told at most while it waits for the first cycle: ten times a second."""


class Compose:
    """One project of `docker compose` with a drive of these options, its router and its dashboard
    published at ports of their own, and environment `variables`.
    """

    def __init__(self, name: str, drive: str, **variables: str) -> None:
        self.endpoint = free_endpoint()
        self.dashboard_port = free_port()
        _, _, port = self.endpoint.rpartition(":")
        self._environment = os.environ | {
            "COGMAP_DRIVE": drive,
            "COGMAP_PORT": port,
            "COGMAP_DASHBOARD_PORT": str(self.dashboard_port),
            "COMPOSE_PROJECT_NAME": f"cogmap-{name}-{os.getpid()}",
            "COMPOSE_PROFILES": "dashboard",
            **variables,
        }

    def __call__(self, *arguments: str) -> str:
        """Run it, which must succeed, and return what it prints."""
        done = self.attempt(*arguments)
        command = " ".join(done.args)
        ends = f"{done.stderr[-3000:]}\n{done.stdout[-3000:]}"
        assert done.returncode == 0, f"{command}:\n{ends}"
        return done.stdout

    def attempt(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run it, whatever its exit code."""
        return subprocess.run(
            ["docker", "compose", *arguments],
            cwd=ROOT,
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
        )

    def started(self, *arguments: str) -> subprocess.Popen[bytes]:
        """Start it, and go on while it runs."""
        command = ["docker", "compose", *arguments]
        silent = subprocess.DEVNULL
        return subprocess.Popen(
            command, cwd=ROOT, env=self._environment, stdout=silent, stderr=silent
        )

    @property
    def running(self) -> list[str]:
        """The ids of all containers that run."""
        ids = self("ps", "--quiet", "--status", "running")
        return ids.split()

    def containers(self, service: str) -> list[str]:
        """The ids of the containers of a service."""
        ids = self("ps", "--quiet", service)
        return ids.split()

    def keys(self, folder: Path, name: str) -> Keys:
        """The keys of a subject of this project, copied into `folder`."""
        self("cp", f"keys:/var/lib/cogmap/keys/{name}", str(folder))
        return Keys(folder / name, name)

    def cogmap(self, service: str, command: str) -> str:
        """What `cogmap` prints in a container of `service`, whatever its exit code."""
        done = self.attempt("exec", "-T", service, "sh", "-c", f"cogmap {command}")
        return done.stdout


def docker(*arguments: str) -> str:
    """What `docker` prints. Raises CalledProcessError."""
    done = subprocess.run(["docker", *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def there_is_docker() -> bool:
    """Whether the engine answers and compose is version 2."""
    if shutil.which("docker") is None:
        return False
    engine = subprocess.run(["docker", "info"], capture_output=True, check=False)
    compose = subprocess.run(["docker", "compose", "version"], capture_output=True, check=False)
    return engine.returncode == 0 and compose.returncode == 0


@pytest.fixture(scope="module")
def image() -> None:
    """The image, built."""
    if there_is_docker():
        Compose("build", drive="")("build")
        return
    missing = "no Docker engine with compose v2"
    if os.environ.get("CI") == "true":
        pytest.fail(missing)
    pytest.skip(missing)


@pytest.mark.parametrize("name", MAX_MB)
def test_an_image_has_little_but_what_it_runs(image: None, name: str) -> None:
    size_bytes = int(docker("image", "inspect", "--format", "{{.Size}}", name))

    assert size_bytes / 1e6 < MAX_MB[name]


def test_the_system_ends_with_its_drive_whose_results_are_in_a_folder_of_the_user(
    image: None, tmp_path: Path
) -> None:
    if os.getuid() != OWNER:
        os.chown(tmp_path, OWNER, OWNER)
    in_lockstep = "--town blocks --explore 8 --lockstep --time-limit 300"
    owner = f"{OWNER}:{OWNER}"
    project = Compose("short", in_lockstep, COGMAP_RUNS=str(tmp_path), COGMAP_USER=owner)
    try:
        output = project("up", "--no-color")
        running = project.running
        told = project("run", "--rm", "cogmap", "log", "summary", "runs/latest", "--json")
    finally:
        project("down", "--volumes", "--timeout", "5")

    run = tmp_path / "latest"
    summary = json.loads((run / "summary.json").read_text())
    assert not running
    assert "route complete" in output
    assert summary["completed"]
    assert json.loads(told)["distance_m"] == pytest.approx(summary["distance_m"])
    assert (run / "map.png").read_bytes().startswith(b"\x89PNG")
    assert (run / "log.mcap").stat().st_uid == OWNER
    assert Recording.read(run / "log.mcap") is not None


@pytest.fixture(scope="module")
def compose(image: None) -> Iterator[Compose]:
    """The running system with two workers, on a long drive."""
    project = Compose("long", drive="--laps 30")
    try:
        project("up", "--detach", "--wait", *WORKERS)
        yield project
    finally:
        project("down", "--volumes", "--timeout", "5")


@pytest.fixture(scope="module")
def watch(compose: Compose, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watch]:
    """An observer from outside the containers, through the published port, with a drive's keys."""
    folder = tmp_path_factory.mktemp("keys")
    watch = Watch(ZenohBus(compose.endpoint, "agent", keys=compose.keys(folder, "drive")))
    yield watch
    watch.close()


def wait_until(watch: Watch, condition: Callable[[], bool]) -> None:
    """Let `watch` receive until `condition` holds."""
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, f"it never happened; present: {sorted(watch.present)}"
        watch.pump(0.1)


def test_all_that_was_waited_for_is_healthy(compose: Compose) -> None:
    for service in SERVICES:
        for container in compose.containers(service):
            state = docker("inspect", "--format", "{{.State.Health.Status}}", container)
            assert state == "healthy", service


def test_frames_lead_to_commands_that_move_the_robot(watch: Watch) -> None:
    wait_until(watch, lambda: watch.tally.observer.travelled_m > 3.0)
    wait_until(watch, lambda: len(watch.tally.cycle_ms) > 5)


def test_nobody_gets_in_without_keys(watch: Watch, compose: Compose) -> None:
    with pytest.raises(AccessError, match="asks for keys"):
        ZenohBus(compose.endpoint, "agent")


def test_a_container_has_its_own_keys_alone(compose: Compose) -> None:
    listed = compose("exec", "-T", "motor", "sh", "-c", "ls /var/lib/cogmap/keys/*/key.pem")

    assert listed.split() == ["/var/lib/cogmap/keys/motor/key.pem"]


def test_each_worker_has_a_name_of_its_own(watch: Watch, compose: Compose) -> None:
    containers = compose.containers("codelets")
    workers = {Member("codelets", f"codelets-{container[:12]}") for container in containers}

    assert len(workers) == 2
    wait_until(watch, lambda: workers <= watch.present)


@pytest.mark.parametrize("service", SERVICES)
def test_no_process_in_a_container_is_roots(compose: Compose, service: str) -> None:
    containers = compose.containers(service)

    assert containers
    for container in containers:
        _, *processes = docker("top", container, "-o", "pid,uid").splitlines()
        users = [process.split()[1] for process in processes]
        assert users
        assert "0" not in users


@pytest.mark.parametrize("service", SERVICES)
def test_a_container_is_bounded_and_writes_to_the_volume_alone(
    compose: Compose, service: str
) -> None:
    for container in compose.containers(service):
        (described,) = json.loads(docker("inspect", container))
        host = described["HostConfig"]
        volumes = [mount["Destination"] for mount in described["Mounts"] if mount["RW"]]

        assert host["ReadonlyRootfs"]
        assert host["CapDrop"] == ["ALL"]
        assert host["Memory"] > 0
        assert 0 < host["PidsLimit"] < 10_000
        assert volumes == ["/var/lib/cogmap/runs"]


def test_the_journal_is_on_the_volume_and_outlives_its_container(
    watch: Watch, compose: Compose
) -> None:
    journal = "runs/latest/state/workspace.journal"
    wait_until(watch, lambda: len(watch.tally.cycle_ms) > 5)
    before = compose("exec", "-T", "workspace", "stat", "--format", "%i %s", journal).split()

    compose("up", "--detach", "--no-deps", "--force-recreate", "workspace")
    enough = len(watch.tally.cycle_ms) + 6
    wait_until(watch, lambda: len(watch.tally.cycle_ms) >= enough)

    after = compose("exec", "-T", "workspace", "stat", "--format", "%i %s", journal).split()
    assert after[0] == before[0]
    assert int(after[1]) > int(before[1])


def test_the_dashboard_shows_the_system_in_its_containers(compose: Compose) -> None:
    async def cycle() -> int:
        address = f"http://127.0.0.1:{compose.dashboard_port}/news"
        async with ClientSession() as session, session.ws_connect(address) as socket:
            for _ in range(MAX_NEWS):
                await socket.send_json({})
                news = json.loads(await socket.receive_bytes(timeout=TIMEOUT_S))
                if news["parts"]["now"]["content"]["cycle"]:
                    break
            shown: int = news["parts"]["now"]["content"]["cycle"]
            return shown

    assert asyncio.run(cycle()) > 0


def test_the_output_names_the_module_of_each_line(compose: Compose) -> None:
    lines = compose("logs", "--no-color").splitlines()
    for service in ("sensory", "workspace", "action", "motor"):
        own = [line for line in lines if line.startswith(f"{service}-1 ")]
        assert any(f"{service} is ready" in line for line in own)


def test_the_log_has_what_the_workspace_publishes_from_its_first_message_on(
    compose: Compose,
) -> None:
    output = compose.cogmap("drive", f"log cat {RUN}/log.mcap presence -n 1 --json")

    first = json.loads(output.splitlines()[0])
    assert first["message"]["seq"] == 0


@pytest.mark.parametrize("service", ["epam", "workspace", "sim", "procedural", "action", "motor"])
def test_a_container_that_is_killed_restarts_and_the_robot_drives_again(
    watch: Watch, compose: Compose, service: str
) -> None:
    member = Member(service, service)
    wait_until(watch, lambda: member in watch.present)
    (container,) = compose.containers(service)

    kill(container)
    wait_until(watch, lambda: member not in watch.present)
    wait_until(watch, lambda: member in watch.present)

    enough = len(watch.tally.cycle_ms) + 6
    wait_until(watch, lambda: len(watch.tally.cycle_ms) >= enough)
    restarts = docker("inspect", "--format", "{{.RestartCount}}", container)
    assert restarts == "1"


def kill(container: str) -> None:
    """Kill its process as the kernel would: `docker kill` would keep it from being restarted."""
    pid = docker("inspect", "--format", "{{.State.Pid}}", container)
    host = ["run", "--rm", "--pid", "host", "--user", "0", "--entrypoint", "sh"]
    docker(*host, "cogmap", "-c", f"kill -9 {pid}")


def test_a_module_is_restarted_under_an_attached_terminal(watch: Watch, compose: Compose) -> None:
    epam = Member("epam", "epam")
    wait_until(watch, lambda: epam in watch.present)
    terminal = compose.started("up", "--no-recreate", *WORKERS)

    compose("restart", "epam")
    enough = len(watch.tally.cycle_ms) + 6
    wait_until(watch, lambda: epam in watch.present and len(watch.tally.cycle_ms) >= enough)

    assert terminal.poll() is None
    terminal.kill()  # asked to end, it would stop the system
    terminal.wait()


def test_a_drive_that_is_stopped_ends_the_system(compose: Compose) -> None:
    compose("stop", "drive")

    deadline_s = time.monotonic() + TIMEOUT_S
    while running := compose.running:
        assert time.monotonic() < deadline_s, running

    for container in compose("ps", "--all", "--quiet").split():
        (described,) = json.loads(docker("inspect", container))
        state = described["State"]
        assert state["ExitCode"] != 137, (described["Name"], "it was killed")
        assert not state["OOMKilled"], described["Name"]


def test_the_image_has_the_experiments(image: None) -> None:
    command = ["experiment", "cue-integration", "--trials", "8", "--seeds", "1"]

    output = docker("run", "--rm", "cogmap", *command)

    assert "runs/cue-integration" in output
