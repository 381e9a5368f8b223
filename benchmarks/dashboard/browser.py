"""A headless browser, of Debian's packages `chromium` and `chromium-driver`."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

from selenium.webdriver import Chrome
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

from cogmap.errors import UsageError

ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-dev-shm-usage",  # in a container it is too small for a page
)


@contextmanager
def browser(
    width_px: int = 1200, height_px: int = 1000, scheme: str = "light", logs: bool = True
) -> Iterator[Chrome]:
    """Open a browser that prefers a colour scheme. Raises UsageError if there is none.

    One that `logs` hands all that its page receives on once more, for `foreign_requests`: that
    costs as much as the page itself.
    """
    driver = shutil.which("chromedriver")
    chromium = shutil.which("chromium")
    if driver is None or chromium is None:
        raise UsageError("no browser is installed: apt-get install chromium chromium-driver")

    options = Options()
    options.binary_location = chromium
    for argument in ARGUMENTS:
        options.add_argument(argument)
    if logs:
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    opened = Chrome(options=options, service=Service(driver))
    try:
        # A window is at least 500 px wide; what a page believes may be narrower.
        metrics = {"width": width_px, "height": height_px, "deviceScaleFactor": 1, "mobile": False}
        opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        feature = {"name": "prefers-color-scheme", "value": scheme}
        opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
        yield opened
    finally:
        opened.quit()


def foreign_requests(opened: Chrome, host: str) -> list[str]:
    """Return the addresses of other hosts that the page has asked for since the last call."""
    found = []
    for entry in opened.get_log("performance"):  # type: ignore[no-untyped-call]
        event = json.loads(entry["message"])["message"]
        request = event["params"].get("request", {})
        parts = urlsplit(request.get("url", ""))
        is_request = event["method"] == "Network.requestWillBeSent"
        if is_request and parts.scheme in ("http", "https", "ws") and parts.netloc != host:
            found.append(request["url"])
    return found
