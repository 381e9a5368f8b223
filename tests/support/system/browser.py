"""A headless browser, of Debian's packages `chromium` and `chromium-driver`."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import axe_core_python
import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.remote.webdriver import WebDriver

from tests.support.system.processes import wait_until

AXE = Path(axe_core_python.__file__).parent / "axe.min.js"
ARGUMENTS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking")


@contextmanager
def browser(
    width_px: int = 1200, height_px: int = 1000, scheme: str = "light"
) -> Iterator[WebDriver]:
    """A browser that prefers that colour scheme. Skips the test where there is none."""
    driver = shutil.which("chromedriver")
    chromium = shutil.which("chromium")
    if driver is None or chromium is None:
        pytest.skip("it needs a browser: apt-get install chromium chromium-driver")

    options = Options()
    options.binary_location = chromium
    for argument in ARGUMENTS:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    opened = webdriver.Chrome(options=options, service=Service(driver))
    try:
        # A window is at least 500 px wide; what a page believes may be narrower.
        metrics = {"width": width_px, "height": height_px, "deviceScaleFactor": 1, "mobile": False}
        opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        feature = {"name": "prefers-color-scheme", "value": scheme}
        opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
        yield opened
    finally:
        opened.quit()


def await_script(opened: WebDriver, script: str, what: str) -> None:
    """Wait until a script of the page returns something true."""
    wait_until(lambda: bool(opened.execute_script(script)), what)


def foreign_requests(opened: WebDriver, host: str) -> list[str]:
    """The addresses of other hosts that the page has asked for."""
    found = []
    for entry in opened.get_log("performance"):
        event = json.loads(entry["message"])["message"]
        request = event["params"].get("request", {})
        parts = urlsplit(request.get("url", ""))
        is_request = event["method"] == "Network.requestWillBeSent"
        if is_request and parts.scheme in ("http", "https", "ws") and parts.netloc != host:
            found.append(request["url"])
    return found


def errors(opened: WebDriver) -> list[str]:
    """What the page has complained of."""
    return [entry["message"] for entry in opened.get_log("browser") if entry["level"] == "SEVERE"]


def faults(opened: WebDriver) -> list[dict[str, Any]]:
    """The serious faults that axe-core finds in the page."""
    opened.execute_script(AXE.read_text("utf-8"))
    found = opened.execute_async_script(
        "const done = arguments[0]; axe.run().then((found) => done(found.violations));"
    )
    return [each for each in found if each["impact"] in ("serious", "critical")]
