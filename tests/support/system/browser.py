"""A headless browser in tests, and what it finds wrong with a page."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import axe_core_python
import pytest
from selenium.webdriver import Chrome

from benchmarks.dashboard import browser as browsers
from cogmap.errors import UsageError
from tests.support.system.processes import wait_until

AXE = Path(axe_core_python.__file__).parent / "axe.min.js"


@contextmanager
def browser(width_px: int = 1200, height_px: int = 1000, scheme: str = "light") -> Iterator[Chrome]:
    """A browser that prefers that colour scheme. Skips the test where there is none."""
    opening = browsers.browser(width_px, height_px, scheme)
    try:
        opened = opening.__enter__()
    except UsageError as error:
        pytest.skip(str(error))
    try:
        yield opened
    finally:
        opening.__exit__(None, None, None)


def await_script(opened: Chrome, script: str, what: str) -> None:
    """Wait until a script of the page returns something true."""
    wait_until(lambda: bool(opened.execute_script(script)), what)


def errors(opened: Chrome) -> list[str]:
    """What the page has complained of."""
    return [entry["message"] for entry in opened.get_log("browser") if entry["level"] == "SEVERE"]


def faults(opened: Chrome) -> list[dict[str, Any]]:
    """The serious faults that axe-core finds in the page."""
    opened.execute_script(AXE.read_text("utf-8"))
    found = opened.execute_async_script(
        "const done = arguments[0]; axe.run().then((found) => done(found.violations));"
    )
    return [each for each in found if each["impact"] in ("serious", "critical")]
