"""What a browser shows of a dashboard, and when."""

from __future__ import annotations

import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
from selenium.webdriver import Chrome

from benchmarks.dashboard.browser import browser, foreign_requests
from benchmarks.dashboard.drives import ADDRESS, COGMAP, LOOK_S, Driven
from cogmap.errors import CogmapError
from cogmap.recording import open_log
from cogmap.schemas import topics
from cogmap.schemas.sensing import View

MOMENTS = 100
LOOK_AGAIN_S = 5.0
SERVES_S = 60.0
READS_S = 300.0
# Notes each frame with the time at which the page has shown its image.
NOTE_FRAMES = """
window.noted = [];
new MutationObserver(() => {
  const { frame, shownMs } = document.documentElement.dataset;
  window.noted.push([Number(frame), Number(shownMs)]);
}).observe(document.documentElement, { attributes: true, attributeFilter: ['data-shown-ms'] });
"""
# Moves the slider, and waits until the page shows that moment and has drawn it.
MOVE_SLIDER = """
const [wanted, done] = arguments;
const slider = document.getElementById('time');
const began = performance.now();
slider.value = wanted;
slider.dispatchEvent(new Event('input'));
slider.dispatchEvent(new Event('change'));
const shown = `${wanted.toFixed(1)} of `;
function look() {
  if (document.getElementById('clock').textContent.startsWith(shown))
    requestAnimationFrame(() => done(performance.now() - began));
  else requestAnimationFrame(look);
}
look();
"""
# What the page has asked other hosts for, so far.
FOREIGN = """
return performance.getEntriesByType('resource').map((each) => each.name)
  .filter((name) => /^(http|ws)/.test(name) && new URL(name).host !== location.host);
"""
IS_READ = "return /^\\S+ of \\S+ s$/.test(document.getElementById('clock').textContent)"


def frames_shown_ms(folder: Path, browsers: int) -> tuple[list[float], int, Driven]:
    """Drive, and watch it in so many browsers until it ends. Returns how long after its sensing
    each frame was on the page of the first, how many requests went to other hosts, and the drive.
    """
    with ExitStack() as opened:
        pages = [opened.enter_context(browser(logs=False)) for _ in range(browsers)]
        driven = Driven(folder, "--dashboard")
        address = driven.address()
        for page in pages:
            page.get(address)
        pages[0].execute_script(NOTE_FRAMES)

        noted: list[tuple[int, int]] = []
        foreign = 0
        while driven.is_running():
            noted = pages[0].execute_script("return window.noted")
            foreign = sum(len(page.execute_script(FOREIGN)) for page in pages)
            time.sleep(LOOK_AGAIN_S)
    driven.end()

    born_ns = {}
    for entry in open_log(driven.log).messages(topics.VIEW):
        assert isinstance(entry.message, View)
        assert entry.envelope is not None
        born_ns[entry.message.frame] = entry.envelope.born_ns
    shown_ms = [at_ms - born_ns[frame] / 1e6 for frame, at_ms in noted if frame in born_ns]
    if not shown_ms:
        raise CogmapError("no frame was on the page: see what `cogmap dashboard` says")
    return shown_ms, foreign, driven


def slider_ms(log: Path) -> tuple[list[float], int]:
    """Move the slider of a log to MOMENTS moments at random. Returns how long each took until the
    page showed it, and how many requests went to other hosts.
    """
    output = log.with_name("dashboard.txt")
    with output.open("w") as said:
        served = subprocess.Popen([*COGMAP, "dashboard", str(log), "--port", "0"], stdout=said)
    try:
        address = _address(output)
        with browser() as page:
            page.get(address)
            page.set_script_timeout(SERVES_S)
            _await(page, IS_READ, READS_S)
            duration_s = float(page.execute_script("return document.getElementById('time').max"))
            moments_s = np.random.default_rng(1).uniform(0.0, duration_s, MOMENTS).round(1)
            moved_ms = [page.execute_async_script(MOVE_SLIDER, at) for at in moments_s.tolist()]
            return moved_ms, len(foreign_requests(page, urlsplit(address).netloc))
    finally:
        served.terminate()
        served.wait()


def _address(output: Path) -> str:
    until_s = time.monotonic() + SERVES_S
    while time.monotonic() < until_s:
        found = ADDRESS.search(output.read_text("utf-8"))
        if found is not None:
            return found[1]
        time.sleep(LOOK_S)
    raise CogmapError(f"{sys.executable} served no dashboard within {SERVES_S:g} s")


def _await(page: Chrome, script: str, limit_s: float) -> None:
    until_s = time.monotonic() + limit_s
    while not page.execute_script(script):
        if time.monotonic() > until_s:
            raise CogmapError(f"the page did not come so far within {limit_s:g} s: {script}")
        time.sleep(LOOK_S)
