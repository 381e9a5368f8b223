"""The dashboard in a real browser: of a running system, and of a log."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import urlopen

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from benchmarks.dashboard.browser import foreign_requests
from cogmap.bus.codec import decode
from cogmap.bus.interface import Arrival
from cogmap.bus.session import free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.schemas import topics
from cogmap.schemas.codelets import Offer
from cogmap.schemas.nodes import Goal
from cogmap.schemas.sensing import MotorCommand
from tests.support.reference import REFERENCE
from tests.support.system.browser import await_script, browser, errors, faults
from tests.support.system.processes import wait_until
from tests.support.system.runs import COGMAP, DRIVING, TIMEOUT_S, Run

PERCEPTS = (
    "--lockstep",
    *("--town", "blocks"),
    *("--set", "sim.sensing=percepts"),
    *("--set", "sim.town_size_m=120"),
)
ADDRESS = re.compile(r"http://\S+")
PANELS = {
    "facts": "document.querySelectorAll('#facts dd').length > 3",
    "map": "/[1-9]\\d* objects/.test(document.getElementById('map-text').textContent)",
    "competitions": "/became conscious/.test(document.getElementById('timeline').ariaLabel)",
    "conscious": "document.getElementById('conscious').textContent.length > 20",
    "schemes": "document.querySelectorAll('#schemes .chosen').length === 1",
    "why": "document.querySelectorAll('#why h3').length === 6",
    "latency": "/ms in the median/.test(document.getElementById('latency').textContent)",
}


class Served:
    """A dashboard that serves, until it is ended."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._output = (folder / "dashboard.txt").open("w+")
        self.process = subprocess.Popen(
            [*COGMAP, "dashboard", "--port", "0", *arguments],
            stdout=self._output,
            stderr=subprocess.STDOUT,
        )
        wait_until(lambda: ADDRESS.search(self.output()) is not None, "it serves")
        found = ADDRESS.search(self.output())
        assert found is not None
        self.address = found[0]

    def output(self) -> str:
        """All that it has printed."""
        assert self.process.poll() is None
        return Path(self._output.name).read_text()

    def close(self) -> None:
        """End it as Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            self.process.wait(TIMEOUT_S)
        self._output.close()


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[..., Served]]:
    """Serves dashboards with any arguments."""
    served: list[Served] = []

    def start(*arguments: str) -> Served:
        served.append(Served(tmp_path, *arguments))
        return served[-1]

    yield start
    for each in served:
        each.close()


ANSWER = "document.getElementById('answer').textContent"
STATUS = "document.getElementById('status').textContent"
IS_THERE = f"return !['waiting', 'no system runs here'].includes({STATUS})"
DRIVES = "/drives|slowed|stands/"
SLIDE_TO_END = """
const slider = document.getElementById('time');
slider.value = slider.max;
slider.dispatchEvent(new Event('input'));
slider.dispatchEvent(new Event('change'));
"""


def show_end(page: Chrome) -> None:
    """Move the slider of a log to its end."""
    await_script(page, "return document.getElementById('time').max > 1", "the slider is there")
    page.execute_script(SLIDE_TO_END)


def test_every_panel_shows_the_running_system_and_a_click_is_a_goal(
    start: Callable[..., Run], serve: Callable[..., Served]
) -> None:
    run = start(*PERCEPTS)
    run.wait_for(DRIVING)
    offered: list[Goal] = []

    def receive(arrival: Arrival) -> None:
        message = decode(topics.OFFER, arrival.payload)
        assert isinstance(message, Offer)
        offered.extend(each for each in message.operations if isinstance(each, Goal))

    served = serve("--connect", run.endpoint)
    with closing(ZenohBus(run.endpoint, "agent")) as bus, browser() as page:
        bus.subscribe(topics.OFFER, receive, lambda _topic, _number: None)
        page.get(served.address)
        for name, shows in PANELS.items():
            await_script(page, f"return {shows}", f"the panel {name} shows something")

        page.find_element(By.ID, "map").click()
        wait_until(lambda: bool(offered), "a goal arrives on the bus")
        given = f"{offered[0].x_m:g},{offered[0].y_m:g} is a goal now"
        await_script(
            page,
            f"return {ANSWER} === '{given}'",
            "the page says what it has done",
        )
        assert faults(page) == []
        assert errors(page) == []
        assert foreign_requests(page, urlsplit(served.address).netloc) == []
    run.close()


def test_keys_drive_a_robot_that_nothing_else_drives(
    start: Callable[..., Run], serve: Callable[..., Served]
) -> None:
    run = start(*PERCEPTS, "--without", "motor")
    run.wait_for("motor")
    commands: list[MotorCommand] = []

    def receive(arrival: Arrival) -> None:
        message = decode(topics.MOTOR_COMMAND, arrival.payload)
        assert isinstance(message, MotorCommand)
        commands.append(message)

    served = serve("--connect", run.endpoint)
    with closing(ZenohBus(run.endpoint, "agent")) as bus, browser() as page:
        bus.subscribe(topics.MOTOR_COMMAND, receive, lambda _topic, _number: None)
        page.get(served.address)
        await_script(page, IS_THERE, "the system is there")
        page.find_element(By.ID, "drive").click()
        await_script(page, f"return {ANSWER} === 'you drive'", "the robot obeys")

        def is_ahead() -> bool:
            assert page.execute_script(f"return {ANSWER}") == "you drive"
            page.find_element(By.TAG_NAME, "body").send_keys(Keys.ARROW_UP)
            return any(each.left_wheel_rad_s > 0.0 for each in commands)

        wait_until(is_ahead, "it drives ahead")
        page.find_element(By.ID, "drive").click()
        await_script(page, f"return {ANSWER} === 'the robot is left alone'", "it is left")
    run.close()


def test_what_drives_already_is_not_driven_by_keys(
    start: Callable[..., Run], serve: Callable[..., Served]
) -> None:
    run = start(*PERCEPTS)
    run.wait_for(DRIVING)
    served = serve("--connect", run.endpoint)
    with browser() as page:
        page.get(served.address)
        await_script(page, IS_THERE, "the system is there")
        page.find_element(By.ID, "drive").click()
        await_script(page, f"return {ANSWER}.includes('--without motor')", "the remedy is said")
    run.close()


def test_a_worker_is_added_and_another_one_is_killed(
    start: Callable[..., Run], serve: Callable[..., Served]
) -> None:
    run = start(*PERCEPTS)
    run.wait_for(DRIVING)
    served = serve("--connect", run.endpoint)
    before = run.pid_of("codelets-1")
    with browser() as page:
        page.get(served.address)
        await_script(page, IS_THERE, "the system is there")
        page.find_element(By.ID, "add").click()
        kill = "[...document.querySelectorAll('#processes button')].map((b) => b.textContent)"
        for name in ("codelets-added-1", "codelets-1"):
            await_script(page, f"return {kill}.includes('Kill {name}')", f"{name} works")

        find = "[...document.querySelectorAll('#processes button')].find"
        page.execute_script(f"{find}((b) => b.textContent === 'Kill codelets-1').click()")
        wait_until(lambda: run.pid_of("codelets-1") not in (before, None), "it runs again")
    run.close()


def test_a_run_serves_its_dashboard_and_names_the_address(start: Callable[..., Run]) -> None:
    run = start(*PERCEPTS, "--dashboard")
    run.wait_for("dashboard: http://127.0.0.1:")
    found = ADDRESS.search(run.output())
    assert found is not None

    def is_served() -> bool:
        try:
            with urlopen(found[0]) as answer:
                return b"Cogmap" in answer.read()
        except OSError:
            return False

    wait_until(is_served, "the page is served")


def test_a_dashboard_waits_for_a_system_and_outlives_it(
    start: Callable[..., Run], serve: Callable[..., Served]
) -> None:
    endpoint = free_endpoint()
    served = serve("--connect", endpoint)
    with browser() as page:
        page.get(served.address)
        await_script(page, f"return {STATUS} === 'no system runs here'", "it says so")
        page.execute_script("document.getElementById('clear').click()")
        await_script(
            page, f"return {ANSWER}.includes('cogmap run')", "a wish is refused with the remedy"
        )

        for _ in range(2):
            run = start(*PERCEPTS, "--connect", endpoint)
            await_script(page, f"return {DRIVES}.test({STATUS})", "the agent is shown")
            run.close()
            await_script(page, f"return {STATUS} === 'no system runs here'", "it is gone")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_log_is_shown_on_a_narrow_screen_too(
    serve: Callable[..., Served], scheme: str, tmp_path: Path
) -> None:
    log = tmp_path / f"{'long' * 20}.mcap"
    shutil.copy(REFERENCE, log)
    served = serve(str(log))
    with browser(320, 800, scheme) as page:
        page.get(served.address)
        show_end(page)
        for name, shows in PANELS.items():
            await_script(page, f"return {shows}", f"the panel {name} shows something")
        await_script(
            page, "return document.getElementById('view').naturalWidth === 96", "the view is shown"
        )

        assert page.execute_script("return document.documentElement.scrollWidth") <= 320
        assert faults(page) == []
        assert errors(page) == []
        assert foreign_requests(page, urlsplit(served.address).netloc) == []


def test_the_messages_of_a_topic_are_shown(serve: Callable[..., Served]) -> None:
    served = serve(str(REFERENCE))
    with browser() as page:
        page.get(served.address)
        show_end(page)
        await_script(
            page, "return document.querySelector('#topic [value=odometry]')", "odometry came"
        )
        page.execute_script("document.getElementById('topic').value = 'odometry'")

        shown = "/speed_m_s: /.test(document.getElementById('message').textContent)"
        await_script(page, f"return {shown}", "the message is shown")


def test_an_address_in_use_is_said_with_the_remedy(serve: Callable[..., Served]) -> None:
    served = serve(str(REFERENCE))
    port = served.address.rsplit(":", 1)[1]
    second = subprocess.run(
        [*COGMAP, "dashboard", str(REFERENCE), "--port", port],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )

    assert second.returncode == 2
    assert "something listens there" in second.stderr
    assert "--port" in second.stderr
